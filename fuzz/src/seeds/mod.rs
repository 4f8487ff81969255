//! Inputs to begin with, made by code: they follow every change of a format, and none is from elsewhere.

mod glb;
mod messages;
mod scenes;

/// The inputs that a target begins with, each with a name.
pub fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    match target {
        "gltf" => scenes::gltf(),
        "mesh_files" => scenes::mesh_files(),
        "wire" => messages::wire(),
        "codec" => messages::codec(),
        "session" => messages::session(),
        "traces" => traces(),
        _ => Vec::new(),
    }
}

fn traces() -> Vec<(String, Vec<u8>)> {
    let texts = [
        (0, "trace", "# a walk\n0 1.7 4 0 0 0 0\n0 1.7 3.5 -10 45 0 500.5\n\n1e3 2 3 0 360 90 1000\n"),
        (1, "link", "rtt=40,jitter=20,mbit=20,stall=300@5000"),
        (
            2,
            "pole",
            r#"{"name": "pot", "single_pole": {"eye": [0, 0, 5], "target": "cube", "size_px": [64, 64], "ring_m": 1}}"#,
        ),
        (
            2,
            "ball",
            r#"{"name": "b", "single_pole": {"target": {"centre": [0, 0, -9], "radius_m": 2}, "size_px": [9, 7], "ring_m": 0}}"#,
        ),
        (
            2,
            "bend",
            r#"{"name": "bent", "graph_camera": {"eye": [0, 1.5, 0], "fov_y_deg": 60, "size_px": [320, 180], "depth_m": 20,
"operations": [{"bend": {"of": "root", "at": {"point": [0, 0, -6], "normal": [1, 0, -1]},
"into": {"name": "right", "direction": [1, 0, 0], "depth_m": 8}}}]}}"#,
        ),
        (
            2,
            "merge",
            r#"{"name": "m", "graph_camera": {"fov_y_deg": 60, "size_px": [64, 36], "depth_m": 9, "limits": [], "operations": [
{"split": {"of": "root", "at": {"after_m": 4}, "between": {"point": [0, 0, 0], "normal": [1, 0, 0]},
"into": [{"name": "left", "direction": [-1, 0, -1], "depth_m": 6}, {"name": "right", "direction": [1, 0, -1], "depth_m": 6}]}},
{"merge": {"of": ["left", "right"], "at": {"point": [0, 0, -7], "normal": [0, 0, -1]},
"into": {"name": "behind", "centre": [0, 0, -1], "depth_m": 8}}}]}}"#,
        ),
    ];
    texts.into_iter().map(|(kind, name, text)| (name.to_owned(), [&[kind], text.as_bytes()].concat())).collect()
}
