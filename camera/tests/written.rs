//! Cameras as people write them: what operations make, that images go on across faces, and what is refused.

use glam::{DQuat, DVec2, DVec3};
use vantage_camera::written::{NamedWritten, WrittenCamera, WrittenError, WrittenGraph};
use vantage_camera::{Bounds, Camera, GraphCamera, Rigid};

/// A corridor along -z from the origin, 2 m wide and 3 m high: what its views do at its end.
fn corridor(operations: &str) -> String {
    format!(
        r#"{{"name": "corridor", "graph_camera": {{
            "eye": [0, 1.5, 0], "fov_y_deg": 60, "size_px": [320, 180], "depth_m": 20, "operations": [{operations}]}}}}"#
    )
}

/// Round a corner to the right, at a plane half way between both directions.
const BEND: &str = r#"{"bend": {"of": "root", "at": {"after_m": 6, "normal": [1, 0, -1]},
    "into": {"name": "right", "direction": [1, 0, 0], "depth_m": 10}}}"#;

/// To both sides of a line ahead.
const SPLIT: &str = r#"{"split": {"of": "root", "at": {"after_m": 4}, "between": {"point": [0, 0, 0], "normal": [1, 0, 0]},
    "into": [{"name": "left", "direction": [-1, 0, -1], "depth_m": 6}, {"name": "right", "direction": [1, 0, -1], "depth_m": 6}]}}"#;

/// Round both sides of what stands ahead, and together again behind it.
const MERGE: &str = r#"{"merge": {"of": ["left", "right"], "at": {"point": [0, 0, -7], "normal": [0, 0, -1]},
    "into": {"name": "behind", "centre": [0, 1.5, -1], "depth_m": 8}}}"#;

fn written(text: &str) -> Result<WrittenCamera, String> {
    let named: NamedWritten = serde_json::from_str(text).map_err(|error| error.to_string())?;
    named.camera().map_err(|error| error.to_string())
}

fn compiled(text: &str) -> Result<Camera, WrittenError> {
    let bounds_of = |name: &str| (name == "ball").then_some(Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE });
    written(text).expect("well formed").compile(&Rigid::IDENTITY, &bounds_of)
}

fn graph(operations: &str) -> GraphCamera {
    let camera = compiled(&corridor(operations)).unwrap_or_else(|error| panic!("{error}"));
    let Camera::Graph(camera) = camera else { panic!("a graph camera") };
    GraphCamera::from_description(camera.description()).expect("as before")
}

fn names(camera: &GraphCamera) -> Vec<&str> {
    camera.frusta().iter().map(|frustum| frustum.name()).collect()
}

/// Points of a convex polygon: its corners, and places between its middle and them.
fn points_of(polygon: &[DVec3]) -> Vec<DVec3> {
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let between = |corner: &DVec3| [0.1, 0.5, 0.9, 1.0].map(|share| middle.lerp(*corner, share));
    polygon.iter().flat_map(between).collect()
}

#[test]
fn images_agree_on_both_sides_of_every_face() {
    for operations in [BEND.to_owned(), SPLIT.to_owned(), format!("{SPLIT}, {MERGE}")] {
        let camera = graph(&operations);
        let mut compared = 0;
        for frustum in camera.frusta() {
            let Some(parent) = frustum.parent().and_then(|id| camera.frustum(id)) else { continue };
            for point in points_of(frustum.face_world()) {
                let (before, behind) = (parent.image_from_world(point), frustum.image_from_world(point));
                let (before, behind) = (before.expect("in view"), behind.expect("in view"));
                let apart_px = DVec2::new(before.u, before.v).distance(DVec2::new(behind.u, behind.v));
                assert!(apart_px < 1e-6, "{}: {apart_px:e} px apart at {point}", frustum.name());
                assert!((before.w - behind.w).abs() < 1e-9 * before.w, "{}: depths differ", frustum.name());
                compared += 1;
            }
        }
        assert!(compared >= 16, "{compared} points of faces");
    }
}

#[test]
fn a_bent_view_looks_round_the_corner() {
    let camera = graph(BEND);
    assert_eq!(names(&camera), ["root", "right"]);
    let pieces = camera.ray(160.0, 90.0);
    assert_eq!(pieces.len(), 2);
    let direction = (pieces[1].to_world - pieces[1].from_world).normalize();
    // The middle ray goes on in the direction that is written, from where it met the plane; the face's mean is beside it.
    assert!(pieces[0].to_world.distance(DVec3::new(0.0, 1.5, -6.0)) < 1e-9, "{}", pieces[0].to_world);
    assert!(direction.dot(DVec3::X) > 0.9, "{direction}");
}

#[test]
fn a_split_view_is_whole_until_its_plane() {
    let camera = graph(SPLIT);
    assert_eq!(names(&camera), ["root", "left", "right"]);
    let goes = |u: f64| {
        let pieces = camera.ray(u, 90.0);
        let last = pieces.last().expect("in view");
        (pieces.len(), camera.frustum(last.frustum).expect("its own").name().to_owned())
    };
    assert_eq!(goes(159.5), (2, "left".to_owned()));
    assert_eq!(goes(160.5), (2, "right".to_owned()));
}

#[test]
fn merged_views_have_one_centre() {
    let camera = graph(&format!("{SPLIT}, {MERGE}"));
    assert_eq!(names(&camera), ["root", "left", "right", "behind", "behind"]);
    let behind: Vec<DVec3> = camera.frusta()[3..].iter().map(|frustum| frustum.centre_world()).collect();
    assert_eq!(behind, [DVec3::new(0.0, 1.5, -1.0); 2]);
    assert_eq!(camera.ray(100.0, 90.0).len(), 3);
    // What merged bends as a whole again.
    let on = r#"{"bend": {"of": "behind", "at": {"after_m": 4}, "into": {"name": "on", "direction": [0, 1, -1], "depth_m": 3}}}"#;
    let camera = graph(&format!("{SPLIT}, {MERGE}, {on}"));
    assert_eq!(camera.ray(100.0, 90.0).len(), 4);
}

#[test]
fn a_camera_is_written_in_a_space_of_its_own() {
    let place = Rigid { rotation: DQuat::from_rotation_y(1.0), translation: DVec3::new(10.0, 0.0, -3.0) };
    let written = written(&corridor(&format!("{SPLIT}, {MERGE}"))).expect("well formed");
    let none = |_: &str| None;
    let here = written.compile(&Rigid::IDENTITY, &none).expect("sound");
    let there = written.compile(&place, &none).expect("sound");
    for point in [DVec3::new(0.3, 1.2, -2.0), DVec3::new(-1.0, 1.6, -5.0), DVec3::new(2.5, 1.1, -8.0)] {
        let (a, b) = (here.image_from_world(point), there.image_from_world(place.transform_point(point)));
        let (a, b) = (a.expect("in view"), b.expect("in view"));
        assert!(DVec2::new(a.u, a.v).distance(DVec2::new(b.u, b.v)) < 1e-6, "{a:?} and {b:?}");
    }
}

#[test]
fn a_single_pole_camera_looks_at_what_is_named() {
    let of = |target: &str| {
        format!(
            r#"{{"name": "pot", "single_pole": {{"eye": [0, 0, 5], "target": {target}, "size_px": [64, 64], "ring_m": 1}}}}"#
        )
    };
    let Ok(Camera::Spoc(named)) = compiled(&of(r#""ball""#)) else { panic!("a single-pole camera") };
    let radius_m = 3.0_f64.sqrt();
    let ball = format!(r#"{{"centre": [0, 0, 0], "radius_m": {radius_m}}}"#);
    let Ok(Camera::Spoc(ball)) = compiled(&of(&ball)) else { panic!("a single-pole camera") };
    assert!((named.push_max_px - ball.push_max_px).abs() < 1e-9 && named.push_max_px > 1.0);
    assert_eq!(compiled(&of(r#""cube""#)), Err(WrittenError::NoTarget { name: "cube".to_owned() }));
    let flat = of(r#""ball""#).replace("[64, 64]", "[64, 0]");
    assert_eq!(compiled(&flat), Err(WrittenError::Size { width_px: 64, height_px: 0 }));
    let inside = of(r#"{"centre": [0, 0, 4], "radius_m": 2}"#);
    assert_eq!(compiled(&inside), Err(WrittenError::EyeInside));
}

#[test]
fn a_description_in_full_is_a_camera_too() {
    let description = serde_json::to_string(graph(BEND).description()).expect("plain");
    let camera = compiled(&format!(r#"{{"name": "full", "graph_description": {description}}}"#)).expect("sound");
    let Camera::Graph(camera) = camera else { panic!("a graph camera") };
    assert_eq!(names(&camera), ["root", "right"]);
}

#[test]
fn what_does_not_fit_is_named() {
    let refused = |operations: &str, words: &[&str]| {
        let error = compiled(&corridor(operations)).expect_err("it does not fit").to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error:?} does not say {words:?}");
    };
    let other = |operation: &str, old: &str, new: &str| {
        assert!(operation.contains(old), "{old}");
        operation.replace(old, new)
    };
    refused(&other(BEND, r#""of": "root""#, r#""of": "hall""#), &["\"right\"", "\"hall\""]);
    refused(&format!("{BEND}, {}", other(BEND, r#""name": "right""#, r#""name": "twice""#)), &["\"twice\"", "already"]);
    refused(&other(BEND, r#""after_m": 6"#, r#""after_m": 60"#), &["\"right\"", "does not cut \"root\""]);
    refused(&other(BEND, r#""after_m": 6, "#, ""), &["\"right\"", "point", "after_m"]);
    refused(&other(BEND, r#""direction": [1, 0, 0], "#, ""), &["\"right\"", "direction", "centre"]);
    refused(&other(BEND, r#""direction": [1, 0, 0]"#, r#""direction": [-1, 0, 1]"#), &["\"right\"", "wrong side"]);
    refused(&other(BEND, r#""depth_m": 10"#, r#""depth_m": -1"#), &["\"right\"", "depth_m"]);
    refused(
        &other(SPLIT, r#""direction": [1, 0, -1]"#, r#""direction": [-1, 0, -1]"#),
        &["\"right\"", "overlaps", "\"left\""],
    );
    refused(&other(SPLIT, r#""name": "right""#, r#""name": "left""#), &["\"left\"", "same name"]);
    refused(&other(SPLIT, r#""at": {"after_m": 4}, "#, ""), &["\"left\"", "split needs"]);
    refused(&format!("{SPLIT}, {}", other(MERGE, r#"["left", "right"]"#, r#"["left"]"#)), &["\"behind\"", "merge"]);
    let on = |k: usize| {
        format!(
            r#"{{"bend": {{"of": "{}", "at": {{"after_m": 0.1}}, "into": {{"name": "{}", "direction": [0, 0, -1], "depth_m": 1}}}}}}"#,
            if k == 0 { "root".to_owned() } else { format!("f{}", k - 1) },
            format_args!("f{k}"),
        )
    };
    let many: Vec<String> = (0..=WrittenGraph::MAX_OPERATIONS).map(on).collect();
    assert!(compiled(&corridor(&many[1..].join(", ").replace("\"f0\"", "\"root\""))).is_ok());
    refused(&many.join(", "), &["\"f64\"", "64 operations"]);
    let kinds = compiled(&corridor(BEND));
    assert!(kinds.is_ok());
    assert!(written(r#"{"name": "none"}"#).expect_err("no camera").contains("exactly one"));
    assert!(written(&corridor(r#"{"twist": {}}"#)).expect_err("no operation").contains("twist"));
}

#[test]
fn numbers_have_their_ranges() {
    let text = corridor(BEND);
    for (old, new, words) in [
        ("[320, 180]", "[320, 0]", "size_px"),
        ("[320, 180]", "[100000, 180]", "size_px"),
        ("[320, 180]", "[4096, 4096]", "size_px"),
        (r#""fov_y_deg": 60"#, r#""fov_y_deg": 180"#, "fov_y_deg"),
        (r#""depth_m": 20"#, r#""depth_m": 0"#, "near_m"),
        (r#""eye": [0, 1.5, 0]"#, r#""eye": [0, 1.5, 0], "look_at": [0, 1.5, 0]"#, "eye"),
        (r#""eye": [0, 1.5, 0]"#, r#""eye": [0, 1e999, 0]"#, "number out of range"),
    ] {
        let text = text.replacen(old, new, 1);
        let error = written(&text)
            .and_then(|written| written.compile(&Rigid::IDENTITY, &|_| None).map_err(|error| error.to_string()));
        let error = error.expect_err("out of range");
        assert!(error.contains(words), "{error:?} does not say {words:?}");
    }
}
