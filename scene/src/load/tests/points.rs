//! What becomes of points and lines.

use serde_json::json;

use super::build::Builder;
use super::{load_ply, load_with};
use crate::load::LoadLimits;

const PLY_POINTS: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
    property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";

#[test]
fn ply_points_without_faces_become_solids_of_their_colours() {
    let text = format!("{PLY_POINTS}end_header\n0 0 0 9 8 7\n2 0 0 1 2 3\n0 2 0 0 0 0\nnan 2 0 0 0 0\n");
    let scene = load_ply(text.as_bytes()).unwrap();
    assert_eq!((scene.triangle_count(), scene.meshes[0].vertices.len()), (3 * 8, 3 * 6));
    assert_eq!(scene.meshes[0].vertices.iter().filter(|vertex| vertex.colour == [9, 8, 7, 255]).count(), 6);
    assert!(scene.warnings[0].contains("4 points without faces are drawn"), "{:?}", scene.warnings);
    let limits = LoadLimits { points: 2, ..LoadLimits::default() };
    let thinned = load_with(crate::load::ply::load, text.as_bytes(), &limits).unwrap();
    assert_eq!(thinned.triangle_count(), 2 * 8);
    assert!(thinned.warnings[0].contains("one of every 2"), "{:?}", thinned.warnings);
}

#[test]
fn points_and_lines_become_solids_that_follow_their_vertices() {
    let of_mode = |mode: u32, indices: &[u8], limits: LoadLimits| {
        let mut builder = Builder::of_positions(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        let indices = builder.accessor(indices, 5121, "SCALAR", indices.len());
        builder.json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        builder.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        let target = builder.floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0], "VEC3");
        builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        builder.animate("weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0], "SCALAR");
        load_with(|bytes, request| super::super::gltf::load(bytes.to_vec(), request), &builder.glb(), &limits).unwrap()
    };
    let all = LoadLimits::default();
    // Two points; two lines and one index over; a loop of three; a strip of two.
    for (mode, indices, solids) in
        [(0, &[2, 0][..], 2), (1, &[0, 1, 1, 2, 0], 2), (2, &[0, 1, 2], 3), (3, &[0, 1, 2], 2)]
    {
        let scene = of_mode(mode, indices, all);
        assert_eq!(scene.triangle_count(), solids * 8, "mode {mode}");
        assert!(scene.warnings[0].contains("are drawn as"), "{:?}", scene.warnings);
        let raised = &scene.at(0.999).deformed[0].vertices;
        let high = |vertex: &&crate::Vertex| vertex.position[2] > 3.0;
        let ends_at_the_last_vertex = if mode == 2 || mode == 0 { 6 } else { 3 };
        assert_eq!(raised.iter().filter(high).count(), ends_at_the_last_vertex, "mode {mode}");
    }
    let thinned = of_mode(0, &[0, 1, 2], LoadLimits { points: 2, ..all });
    assert_eq!(thinned.triangle_count(), 2 * 8);
    assert!(thinned.warnings[0].contains("one of every 2"), "{:?}", thinned.warnings);
}
