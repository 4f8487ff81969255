//! Files that mean harm.

use proptest::prelude::*;
use serde_json::json;

use super::build::{Builder, TRIANGLE};
use super::{TestFolder, load_gltf, load_obj, load_ply, load_stl, load_with, refusal};
use crate::load::{LoadLimits, load};

fn error_of(change: impl FnOnce(&mut Builder)) -> String {
    let mut builder = Builder::of_positions(&TRIANGLE);
    change(&mut builder);
    load_gltf(&builder.glb()).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn claims_past_the_file_are_errors_that_name_the_place() {
    let error = error_of(|b| b.json["accessors"][0]["count"] = json!(4_000_000_000_u64));
    assert!(error.contains("vertices: 4000000000 is more than the limit"), "{error}");
    let error = error_of(|b| b.json["accessors"][0]["count"] = json!(4));
    assert!(error.contains("accessors[0]") && error.contains("past the 36 bytes"), "{error}");
    let error = error_of(|b| b.json["accessors"][0]["byteOffset"] = json!(u64::MAX));
    assert!(error.contains("accessors[0]"), "{error}");
    let error = error_of(|b| b.json["bufferViews"][0]["byteLength"] = json!(u64::MAX));
    assert!(error.contains("bufferViews[0]"), "{error}");
}

#[test]
fn indices_that_lead_nowhere_are_named() {
    let error = error_of(|b| {
        let indices = b.accessor(&[0, 1, 9], 5121, "SCALAR", 3);
        b.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    });
    assert!(error.contains("meshes[0].primitives[0].indices: index 9 is past the 3 vertices"), "{error}");
    let error = error_of(|b| b.json["nodes"][0]["mesh"] = json!(7));
    assert!(error.contains("nodes[0].mesh"), "{error}");
    let error = error_of(|b| b.json["meshes"][0]["primitives"][0]["material"] = json!(3));
    assert!(error.contains("material 3"), "{error}");
}

#[test]
fn hierarchies_without_end_are_refused() {
    let error = error_of(|b| b.json["nodes"][0]["children"] = json!([0]));
    assert!(error.contains("nodes[0]: the node is its own ancestor"), "{error}");
    let error = error_of(|b| {
        let deep = 20_000;
        b.json["nodes"] =
            (0..deep).map(|i| if i + 1 < deep { json!({"children": [i + 1]}) } else { json!({"mesh": 0}) }).collect();
    });
    assert!(error.contains("depth") && error.contains("1024"), "{error}");
    let nested = "[".repeat(100_000) + &"]".repeat(100_000);
    let error = refusal(load_gltf(nested.as_bytes()));
    assert!(error.contains("recursion limit"), "{error}");
}

#[test]
fn what_cannot_be_shown_is_named_and_the_rest_is_shown() {
    let mut builder = Builder::of_positions(&TRIANGLE);
    builder.json["extensionsRequired"] = json!(["ACME_teapots"]);
    builder.json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap()
        .push(json!({"attributes": {"POSITION": 0}, "indices": 9}));
    let scene = load_gltf(&builder.glb()).unwrap();
    assert_eq!(scene.triangle_count(), 1);
    for expected in
        ["requires ACME_teapots", "accessor 9 does not exist, there are 1; meshes[0].primitives[1] is left out"]
    {
        assert!(scene.warnings.iter().any(|warning| warning.contains(expected)), "{:?}", scene.warnings);
    }
    let error = error_of(|b| {
        b.json["extensionsRequired"] = json!(["ACME_teapots"]);
        b.json["meshes"][0]["primitives"][0]["indices"] = json!(9);
    });
    assert!(error.contains("nothing to draw") && error.contains("ACME_teapots"), "{error}");
}

#[test]
fn faulty_triangles_are_counted_and_dropped() {
    let mut positions = TRIANGLE.to_vec();
    positions.extend([f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    positions.extend([0.0, 0.0, f32::INFINITY, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    positions.extend([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let scene = load_gltf(&Builder::of_positions(&positions).glb()).unwrap();
    assert_eq!(scene.triangle_count(), 1);
    assert!(
        scene.warnings.iter().any(|w| w.contains("2 triangles with a position that is not finite")),
        "{:?}",
        scene.warnings
    );
    assert!(scene.warnings.iter().any(|w| w.contains("1 degenerate triangles")), "{:?}", scene.warnings);
}

#[test]
fn files_outside_of_the_folder_are_refused() {
    let folder = TestFolder::new("outside");
    let secret = folder.write("secret.bin", &[0; 36]);
    std::fs::create_dir_all(folder.0.join("scene")).unwrap();
    let mut uris = vec![
        "../secret.bin".to_owned(),
        "%2e%2e/secret.bin".to_owned(),
        "..\\secret.bin".to_owned(),
        secret.to_string_lossy().into_owned(),
        "https://example.org/a.bin".to_owned(),
        "file:///etc/passwd".to_owned(),
        "//host/share".to_owned(),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, folder.0.join("scene/link.bin")).unwrap();
        uris.push("link.bin".to_owned());
    }
    for uri in uris {
        let mut json = Builder::of_positions(&TRIANGLE).json;
        json["buffers"] = json!([{"byteLength": 36, "uri": uri}]);
        let path = folder.write("scene/a.gltf", json.to_string().as_bytes());
        let error = load(&path, &LoadLimits::default(), &|_| {}).map(|_| ()).unwrap_err();
        assert!(matches!(error, crate::load::LoadError::Outside { .. }), "{uri}: {error}");
    }
}

#[test]
fn limits_are_kept() {
    let glb = Builder::of_positions(&TRIANGLE).glb();
    let limits = |change: fn(&mut LoadLimits)| {
        let mut limits = LoadLimits::default();
        change(&mut limits);
        load_with(|bytes, request| super::super::gltf::load(bytes.to_vec(), request), &glb, &limits)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    assert!(limits(|l| l.vertices = 2).contains("vertices: 3"));
    assert!(limits(|l| l.json_values = 5).contains("JSON values"));
    assert!(limits(|l| l.nodes = 0).contains("nodes: 1"));
    assert!(limits(|l| l.instances = 0).contains("instances"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Any byte may be wrong: the loader ends, with or without a scene.
    #[test]
    fn damaged_files_do_no_harm(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let mut builder = Builder::of_positions(&TRIANGLE);
        let target = builder.floats(&[0.5; 9], "VEC3");
        builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        builder.animate("weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0], "SCALAR");
        let mut glb = builder.glb();
        let mut ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0000111122223000011112222".to_vec();
        let mut obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\no a\nusemtl b\nf 1/1/1 2/1/1 3//1 -1\n".to_vec();
        let mut stl = [&[b' '; 80][..], &2_u32.to_le_bytes(), &[0x3F; 100]].concat();
        let mut stl_text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n".to_vec();
        let mut cloud = b"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0 1 0 0 1 0 0 0 1e9 0 -7 8 9".to_vec();
        for (index, byte) in &changes {
            for bytes in [&mut glb, &mut ply, &mut obj, &mut stl, &mut stl_text, &mut cloud] {
                let place = index.index(bytes.len());
                bytes[place] = *byte;
            }
        }
        let obj = load_obj(&String::from_utf8_lossy(&obj));
        let loaded = [load_gltf(&glb), load_ply(&ply), obj, load_stl(&stl), load_stl(&stl_text), load_ply(&cloud)];
        for scene in loaded.into_iter().flatten() {
            prop_assert!(scene.at(0.3).world_from_mesh.iter().all(|place| place.is_finite()));
        }
    }
}
