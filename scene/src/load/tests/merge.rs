//! Files of more parts than there are ids for objects.

use glam::{DVec3, Vec3};
use serde_json::json;

use super::build::{Builder, TRIANGLE};
use super::{load_with, refusal};
use crate::Scene;
use crate::load::{LoadError, LoadLimits};

/// Nodes in rows, of two materials in turn, some mirrored, some sheared, the first of which moves.
fn many(parts: usize) -> Vec<u8> {
    let mut builder = Builder::of_positions(&TRIANGLE);
    let colour = |red: f32| json!({"pbrMetallicRoughness": {"baseColorFactor": [red, 0.5, 0.5, 1.0]}});
    builder.json["materials"] = json!([colour(0.25), colour(0.75)]);
    builder.json["meshes"] = json!([
        {"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]},
    ]);
    let node = |index: usize| {
        let (x, z) = ((index % 10) as f64 * 3.0, (index / 10) as f64 * 3.0 + 5_000_000.0);
        let (mirrored, shear) = (if index % 3 == 1 { -1 } else { 1 }, if index % 5 == 2 { 0.5 } else { 0.0 });
        let matrix = json!([mirrored, 0, 0, 0, shear, 1, 0, 0, 0, 0, 1, 0, x, 0, z, 1]);
        json!({"mesh": index % 2, "name": format!("part {index}"), "matrix": matrix})
    };
    builder.json["nodes"] = (0..parts).map(node).collect();
    builder.json["nodes"][0] = json!({"mesh": 0, "translation": [0, 0, 5_000_000]});
    builder.json["scenes"] = json!([{"nodes": (0..parts).collect::<Vec<_>>()}]);
    builder.animate("translation", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 5e6, 2.0, 0.0, 5e6], "VEC3");
    builder.glb()
}

fn load(glb: &[u8], objects: u64, triangles: u64) -> Result<Scene, LoadError> {
    let limits = LoadLimits { objects, triangles, ..LoadLimits::default() };
    load_with(|bytes, request| super::super::gltf::load(bytes.to_vec(), request), glb, &limits)
}

/// All triangles at a time, in world space: corners and the first one's normal to a millimetre, and the material.
fn triangles(scene: &Scene, time_s: f64) -> Vec<([[i64; 3]; 4], u32)> {
    let snapshot = scene.at(time_s);
    let thousandths = |at: DVec3| (at * 1e3).round().as_i64vec3().to_array();
    let mut all = Vec::new();
    for (instance, place) in scene.instances.iter().zip(&snapshot.world_from_mesh) {
        let mesh = &scene.meshes[instance.mesh as usize];
        let normals = place.matrix3.inverse().transpose();
        for corners in mesh.indices.as_chunks::<3>().0 {
            // As they are seen, whether or not their place mirrors them; from the least corner on.
            let [a, b, c] =
                if place.matrix3.determinant() < 0.0 { [corners[0], corners[2], corners[1]] } else { *corners };
            let vertices = [a, b, c].map(|index| &mesh.vertices[index as usize]);
            let [a, b, c] = vertices.map(|vertex| place.transform_point3(Vec3::from(vertex.position).as_dvec3()));
            let normal = (normals * Vec3::from(vertices[0].normal).as_dvec3()).normalize();
            all.push(([a, b, c, normal].map(thousandths), mesh.material));
        }
    }
    all.sort_unstable();
    all
}

#[test]
fn neighbours_of_one_material_are_one_object_and_look_as_before() {
    let glb = many(100);
    let apart = load(&glb, 100, 1000).unwrap();
    assert_eq!((apart.instances.len(), apart.warnings.len()), (100, 0));
    let together = load(&glb, 12, 1000).unwrap();
    assert_eq!(together.instances.len(), 12, "no more than it takes");
    assert!(together.warnings[0].contains("100 parts"), "{:?}", together.warnings);
    assert_eq!(together.bounds, apart.bounds);
    for time_s in [0.0, 0.5] {
        assert_eq!(triangles(&together, time_s), triangles(&apart, time_s));
    }
    let moving: Vec<usize> = (0..together.instances.len()).filter(|&index| together.instances[index].moves).collect();
    assert_eq!(moving, [0], "what moves keeps to itself");
    assert!(together.instances[1].name.starts_with("part ") && together.instances[1].name.ends_with("and others"));
    // Neighbours: of a floor of 30 m each takes a part, where in the file's order each would take a whole row.
    let widths = together.meshes.iter().map(|mesh| mesh.bounds[1][0] - mesh.bounds[0][0]);
    let mean_m = widths.sum::<f32>() / together.meshes.len() as f32;
    assert!(mean_m < 20.0, "{mean_m} m");
}

#[test]
fn more_than_can_be_put_together_is_refused_by_name() {
    let glb = many(100);
    assert_eq!(load(&glb, 3, 1000).unwrap().instances.len(), 3, "one that moves, and one of each material");
    let error = refusal(load(&glb, 2, 1000));
    assert!(error.contains("objects that move or have a material of their own"), "{error}");
    let error = refusal(load(&glb, 12, 50));
    assert!(error.contains("triangles of parts that are put together"), "{error}");
}

/// As many as no 16 bits tell apart.
#[test]
fn a_hundred_thousand_parts_are_loaded() {
    let scene = load(&many(100_000), 65_535, 1 << 25).unwrap();
    assert_eq!((scene.instances.len(), scene.triangle_count()), (65_535, 100_000));
    let largest = scene.meshes.iter().map(|mesh| mesh.indices.len() / 3).max();
    assert!(largest <= Some(4), "they grow evenly: {largest:?}");
}
