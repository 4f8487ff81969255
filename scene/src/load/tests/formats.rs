//! What OBJ, PLY and STL files mean.

use glam::DVec3;

use super::{TestFolder, assert_near, first_triangle, load_chosen, load_obj, load_ply, load_stl, refusal};
use crate::load::{Choice, LoadLimits, Up, load, obj};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn obj_polygons_become_fans_and_indices_may_be_negative() {
    let scene = load_obj(&format!("{SQUARE}f -4 -3 -2 -1\n")).unwrap();
    assert_eq!(scene.triangle_count(), 2);
    assert_eq!(scene.meshes[0].vertices[0].normal, [0.0, 0.0, 1.0]);
    assert!(scene.materials.iter().all(|material| material.double_sided), "a sheet has two sides");
}

#[test]
fn obj_coordinates_keep_the_precision_of_the_text() {
    let scene = load_obj("v 10000000.125 0 0\nv 10000001.125 0 0\nv 10000000.125 1 0\nf 1 2 3\n").unwrap();
    assert_eq!(first_triangle(&scene, 0.0)[1].x, 10_000_001.125);
}

#[test]
fn obj_faults_are_named_by_line() {
    for (text, expected) in [
        ("v 0 0\n", "line 1"),
        ("v 0 0 0\nf 1 2 3\n", "line 2: an index is out of range"),
        ("v 0 0 x\n", "line 1"),
        ("v 0 0 0\n", "no faces"),
    ] {
        let error = refusal(load_obj(text));
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn obj_materials_come_from_the_library_beside_it() {
    let folder = TestFolder::new("mtl");
    folder.write("a.mtl", b"newmtl red\nKd 1 0 0\nd 0.25\nmap_Kd missing.png\n");
    let path =
        folder.write("a.obj", format!("mtllib a.mtl\nmtllib ../a.mtl\n{SQUARE}usemtl red\nf 1 2 3 4\n").as_bytes());
    let scene = load(&path, &LoadLimits::default(), &|_| {}).unwrap();
    let material = &scene.materials[scene.meshes[0].material as usize];
    assert_eq!((material.base_colour, material.alpha_cutoff), ([1.0, 0.0, 0.0, 0.25], Some(0.5)));
    assert!(scene.is_seen_through(scene.meshes[0].material as usize));
    for expected in ["missing.png", "../a.mtl"] {
        assert!(scene.warnings.iter().any(|warning| warning.contains(expected)), "{:?}", scene.warnings);
    }
}

const PLY_HEADER: &str = "element vertex 3\nproperty float x\nproperty double y\nproperty short z\nproperty uchar red\n\
    property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn binary_ply(big_endian: bool) -> Vec<u8> {
    let format = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!("ply\nformat {format} 1.0\n{PLY_HEADER}").into_bytes();
    let mut put = |mut value: Vec<u8>| {
        if big_endian {
            value.reverse();
        }
        bytes.extend(value);
    };
    for [x, y, z] in [[0_i16, 0, 0], [1, 0, 0], [0, 1, -2]] {
        put(f32::from(x).to_le_bytes().to_vec());
        put(f64::from(y).to_le_bytes().to_vec());
        put(z.to_le_bytes().to_vec());
        [255, 0, 51].iter().for_each(|&byte| put(vec![byte]));
    }
    put(vec![3]);
    [0_i32, 1, 2].iter().for_each(|index| put(index.to_le_bytes().to_vec()));
    bytes
}

#[test]
fn ply_of_all_encodings_is_the_same() {
    let ascii =
        format!("ply\nformat ascii 1.0\n{PLY_HEADER}0 0 0 255 0 51\n1 0 0 255 0 51\n0 1 -2 255 0 51\n3 0 1 2\n");
    let scenes = [ascii.into_bytes(), binary_ply(false), binary_ply(true)].map(|bytes| load_ply(&bytes).unwrap());
    for scene in &scenes {
        assert_near(first_triangle(scene, 0.0)[2], [0.0, 1.0, -2.0]);
        assert_eq!(scene.meshes[0].vertices[0].colour, [255, 0, 51, 255]);
    }
    assert_eq!(scenes[0].meshes, scenes[1].meshes);
    assert_eq!(scenes[1].meshes, scenes[2].meshes);
}

#[test]
fn ply_claims_are_compared_with_the_file() {
    let header = |count: &str| {
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nend_header\n")
    };
    for count in ["4000000000", "18446744073709551615"] {
        let error = refusal(load_ply(header(count).as_bytes()));
        assert!(error.contains("elements need"), "{error}");
    }
    let list =
        "ply\nformat ascii 1.0\nelement face 1\nproperty list uint int vertex_indices\nend_header\n4000000000 1\n";
    assert!(refusal(load_ply(list.as_bytes())).contains("too early"));
}

#[test]
fn ply_strips_face_one_way_and_points_beside_triangles_are_left() {
    let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
    let scene = load_ply(format!("{head}{strips}{points}8 0 1 2 3 -1 1 3 9\n").as_bytes()).unwrap();
    assert_eq!(scene.triangle_count(), 2);
    assert!(scene.meshes[0].vertices.iter().all(|vertex| vertex.normal == [0.0, 0.0, 1.0]));
    assert!(scene.warnings[0].contains("1 triangles with indices past the vertices"), "{:?}", scene.warnings);
}

const STL_ASCII: &str = "solid a\nfacet normal 0 0 9\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1e0 0\n\
    endloop\nendfacet\nendsolid a\n";

fn stl_binary(claimed: u32) -> Vec<u8> {
    let mut bytes = b"solid of a program that begins every file so".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(claimed.to_le_bytes());
    let floats = [0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0_f32];
    bytes.extend(floats.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes
}

#[test]
fn stl_of_both_encodings_is_the_same() {
    let [text, binary] = [STL_ASCII.as_bytes(), &stl_binary(1)].map(|bytes| load_stl(bytes).unwrap());
    assert_eq!(text.meshes, binary.meshes);
    assert_near(first_triangle(&text, 0.0)[2], [0.0, 1.0, 0.0]);
    assert!(text.meshes[0].vertices.iter().all(|vertex| vertex.normal == [0.0, 0.0, 1.0]));
    assert!(text.warnings.is_empty() && text.materials[0].double_sided);
}

#[test]
fn stl_faults_are_named() {
    let mut claims_more = stl_binary(4_000_000_000);
    claims_more[..5].copy_from_slice(b"other");
    let mut longer = stl_binary(1);
    longer[..5].copy_from_slice(b"other");
    longer.extend([7; 60]);
    assert!(load_stl(&longer).unwrap().warnings[0].contains("60 bytes past the last facet"));
    let faults: [(&[u8], &str); 5] = [
        (&claims_more, "4000000000 facets, but there are bytes for 1"),
        (b"solid\nfacet\nvertex 0 0\n", "line 3: a vertex needs three numbers"),
        (b"solid\nfacet\nvertex 0 0 0\nendfacet\n", "line 4: a facet does not have three corners"),
        (b"solid\nfacet\nvertex 0 0 0\n", "ends inside of a facet"),
        (b"nothing", "neither a binary header"),
    ];
    for (bytes, expected) in faults {
        let error = refusal(load_stl(bytes));
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_file_that_lies_on_its_side_is_set_up() {
    let ground = b"v 0 0 0\nv 6 0 0\nv 6 5 0\nv 0 5 1\nf 1 2 3 4\n";
    let of =
        |up| load_chosen(obj::load, ground, (&LoadLimits::default(), &Choice { up, ..Choice::default() })).unwrap();
    let (lies, stands) = (of(Up::Y), of(Up::Z));
    assert_eq!((lies.bounds.min, lies.bounds.max), (DVec3::ZERO, DVec3::new(6.0, 5.0, 1.0)));
    assert_eq!((stands.bounds.min, stands.bounds.max), (DVec3::new(0.0, 0.0, -5.0), DVec3::new(6.0, 1.0, 0.0)));
    assert!(!lies.walk && stands.walk, "one walks on what is flat");
}
