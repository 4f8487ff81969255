//! Cameras that people write, from the file to the image: what of it is drawn is what their rays meet, and sessions that ask for one
//! are sent its image and nothing else.

mod common;

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use camera::written::WrittenCamera;
use camera::{Camera, GraphCamera};
use common::session::{INTERVAL_S, Session};
use common::triangles::{distance_to_triangle, triangles};
use common::*;
use glam::{DVec2, DVec3};
use protocol::{Edit, Purpose};
use scene::Scene;
use vantage_server::asked::Asked;
use vantage_server::cameras;
use vantage_server::frame::Made;
use vantage_server::impostors::draw::coverage::world_sample;
use vantage_server::impostors::draw::{ImpostorCapture, ImpostorDrawer, Subject};
use vantage_server::plan::Reason;
use vantage_server::render::SceneRenderer;

/// A built-in scene, which may be the one that moves, with the cameras that are written for it as examples.
fn with_cameras(name: &str) -> Scene {
    let mut scene = scene::builtin::load(name).expect("built in");
    let name = name.trim_end_matches("-moving");
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/cameras").join(format!("{name}.json"));
    cameras::add(&mut scene, &file).unwrap_or_else(|error| panic!("{error}"));
    scene
}

/// What a ray of a graph camera meets first: the triangle's id, counted from 1 as in captures, and `w` there.
fn traced(renderer: &SceneRenderer, camera: &GraphCamera, at_px: DVec2) -> Option<(u32, f64)> {
    let (rays, anchor_world) = (renderer.rays().expect("made with rays"), renderer.anchor_world());
    camera.ray(at_px.x, at_px.y).iter().find_map(|piece| {
        let (origin, way) = (piece.from_world - anchor_world, piece.to_world - piece.from_world);
        let hit = rays.first_hit(origin.as_vec3(), way.as_vec3(), 0.0, 1.0)?;
        // Along a ray within a frustum `1/w` grows evenly.
        let (from, to) = (1.0 / piece.w_from, 1.0 / piece.w_to);
        Some((hit.triangle, 1.0 / (from + (to - from) * f64::from(hit.t))))
    })
}

/// How a capture differs from what rays meet.
#[derive(Debug, Default)]
struct Differences {
    pixels: usize,
    /// Pixels whose ray met what it shows behind a face.
    behind_faces: usize,
    /// Pixels that show another triangle than their ray meets: edges pass between.
    at_edges: usize,
    /// Of these, those that show what no ray within a pixel sees.
    beyond_edges: usize,
    /// How far a sample lies from the triangle that it names at most, in pixels as large as they are there.
    off_px: f64,
}

fn differences(
    scene: &Scene,
    renderer: &SceneRenderer,
    camera: &GraphCamera,
    capture: &ImpostorCapture,
) -> Differences {
    let (triangles, (width, _)) = (triangles(scene), camera.size_px());
    let mut differences = Differences { pixels: capture.ids.len(), ..Differences::default() };
    for (index, ids) in capture.ids.iter().enumerate() {
        let at_px = DVec2::new((index % width as usize) as f64 + 0.5, (index / width as usize) as f64 + 0.5);
        let sample = world_sample(capture, index);
        let off_px = sample.map_or(0.0, |sample| {
            distance_to_triangle(sample.position_world, triangles[ids[0] as usize - 1]) / sample.footprint_m
        });
        differences.off_px = differences.off_px.max(off_px);
        let met = traced(renderer, camera, at_px);
        if met.map_or(0, |(triangle, _)| triangle) == ids[0] {
            let leaves_root = |w: f64| camera.ray(at_px.x, at_px.y).first().is_some_and(|root| root.w_to > w);
            differences.behind_faces += usize::from(met.is_some_and(|(_, w)| leaves_root(w)));
            continue;
        }
        differences.at_edges += 1;
        // What is seen edge-on is narrower than rays lie apart: it is seen where nothing nearer is, by more than a pixel's extent.
        let is_seen = |at_px: DVec2| match (traced(renderer, camera, at_px), &sample) {
            (Some((triangle, w)), Some(sample)) => {
                triangle == ids[0] || 1.0 / w >= 1.0 / f64::from(capture.w[index]) - sample.footprint_m
            }
            (None, _) => true,
            (Some(_), None) => false,
        };
        // Half a pixel and a whole one away, in 16 directions.
        let around = (1..=2).flat_map(|half| (0..16).map(move |turn| (f64::from(half) / 2.0, f64::from(turn) / 16.0)));
        let mut around = around.map(|(off_px, turn)| at_px + DVec2::from_angle(turn * TAU) * off_px);
        differences.beyond_edges += usize::from(!around.any(is_seen));
    }
    differences
}

#[test]
fn images_show_what_rays_meet_without_a_seam() {
    let gpu = gpu();
    for name in ["mirror-maze", "urban", "pillars"] {
        let scene = with_cameras(name);
        for named in &scene.named_cameras {
            let Camera::Graph(camera) = &named.camera else { continue };
            let mut renderer = SceneRenderer::with_pulling(&gpu, &scene).expect("it fits").with_rays(&scene);
            renderer.update(&scene.at(0.0), named.camera.eye_world()).expect("placed");
            let mut drawer = ImpostorDrawer::new(&renderer).expect("a drawer");
            let capture = drawer.draw(&renderer, &named.camera, Subject::ALL).expect("drawn");
            let found = differences(&scene, &renderer, camera, &capture);
            println!("{name}, {}: {found:?}", named.name);
            assert!(
                found.behind_faces * 20 > found.pixels,
                "{name}: hardly anything is seen round a corner: {found:?}"
            );
            // A thousandth: no image has more pixels whose centre lies on an edge, to the rounding of positions.
            assert!(found.beyond_edges == 0 && found.at_edges * 1000 < found.pixels, "{name}: {found:?}");
            assert!(found.off_px < 1.0, "{name}: {found:?}");
        }
    }
}

/// Where the ray of a pixel enters the last frustum on its way, and the number of frusta.
fn last_entry(camera: &GraphCamera, x: u32, y: u32) -> (usize, DVec3) {
    let pieces = camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
    (pieces.len(), pieces.last().map_or(DVec3::ZERO, |piece| piece.from_world))
}

/// Views that part around something must meet again behind it: else the image is torn where none of its faces is.
#[test]
fn rays_side_by_side_enter_their_last_frusta_side_by_side() {
    for name in ["mirror-maze", "urban", "pillars"] {
        let scene = with_cameras(name);
        let Camera::Graph(camera) = &scene.named_cameras[0].camera else { panic!("a graph camera") };
        let (width, height) = camera.size_px();
        let mut compared = 0;
        for y in (0..height).step_by(20) {
            let entries: Vec<_> = (0..width).map(|x| last_entry(camera, x, y)).collect();
            for (x, four) in
                entries.windows(4).enumerate().filter(|(_, four)| four.iter().all(|end| end.0 == four[0].0))
            {
                let apart_m = |k: usize| four[k].1.distance(four[k + 1].1);
                assert!(apart_m(1) <= 2.0 * apart_m(0).max(apart_m(2)), "{name}: torn at {} {y}", x + 1);
                compared += usize::from(four[0].0 > 1);
            }
        }
        assert!(compared * 20 * 10 > (width * height) as usize, "{name}: {compared} behind a face");
    }
}

/// A session with a scene's first written camera.
fn asking(scene: Scene) -> Session {
    let camera = scene.named_cameras[0].camera.clone();
    let mut session = Session::new(scene);
    session.client.asked = Some(Asked::of(camera));
    session
}

/// The only patch that is held, which must be the image that was asked for.
fn the_image(session: &Session) -> &protocol::DepthImage {
    let patches: Vec<_> = session.held.patches.values().collect();
    let [held] = patches.as_slice() else { panic!("{} patches are held", patches.len()) };
    assert_eq!(held.patch.purpose, Purpose::Camera);
    &held.patch.image
}

fn says_nothing_else(made: &Made) -> bool {
    let belongs = |edit: &Edit| match edit {
        Edit::Add(patch) => patch.purpose == Purpose::Camera && patch.objects.is_empty(),
        Edit::Clear | Edit::Remove(_) | Edit::Materials(_) | Edit::Light(_) | Edit::Sky(_) => true,
        _ => false,
    };
    made.reason == Reason::Camera && made.update.edits.iter().all(belongs) && made.update.next.objects.is_empty()
}

#[test]
fn who_asks_for_a_camera_is_sent_its_image_alone_once_in_a_still_scene() {
    let scene = with_cameras("urban");
    let mut session = asking(scene);
    let first = session.tick().expect("an image");
    assert!(says_nothing_else(&first), "{:?}", first.reason);
    let image = the_image(&session).clone();
    assert_eq!(image.camera, session.scene.named_cameras[0].camera);
    assert!(image.sample_count() * 2 > 960 * 540, "{} samples", image.sample_count());
    for _ in 0..3 {
        session.walk_to(session.viewer.world_from_eye, 2);
        assert!(session.tick().is_none(), "whatever its eye does");
    }
    session.start_anew();
    assert!(session.tick().is_some_and(|made| says_nothing_else(&made)));
    assert!(*the_image(&session) == image, "the same again");
}

#[test]
fn a_scene_that_moves_is_sent_anew_and_what_stands_still_is_not() {
    let mut session = asking(with_cameras("pillars-moving"));
    assert!(session.scene.is_animated());
    session.tick().expect("an image");
    let (first, first_id) = (the_image(&session).clone(), *session.held.patches.keys().next().expect("one"));
    let made = session.tick().expect("crates moved");
    assert!(says_nothing_else(&made));
    assert!(made.update.edits.iter().any(|edit| matches!(edit, Edit::Remove(id) if *id == first_id)));
    assert!(*the_image(&session) != first, "the only one that is held is the new one");
    // The scene's time stands.
    session.now_s -= INTERVAL_S;
    assert!(session.tick().is_none(), "the same image is not sent again");
}

/// What is said of a file with this text; the file is gone again.
fn refusal(text: &str) -> String {
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let number = FILES.fetch_add(1, Ordering::Relaxed);
    let file = std::env::temp_dir().join(format!("vantage-cameras-{}-{number}.json", std::process::id()));
    std::fs::write(&file, text).expect("a place for files");
    let added = cameras::add(&mut scene::builtin::load("pillars").expect("built in"), &file);
    std::fs::remove_file(&file).expect("it was there");
    let error = added.expect_err("it is malformed").to_string();
    assert!(error.contains(file.to_str().expect("plain")), "{error:?} does not name the file");
    error
}

#[test]
fn what_is_wrong_with_a_file_is_said_by_file_camera_and_frustum() {
    let bent = |name: &str, of: &str, more: &str| {
        format!(
            r#"{{"name": "{name}", "graph_camera": {{"fov_y_deg": 60, "size_px": [64, 36], "depth_m": 9, "operations": [
            {{"bend": {{"of": "{of}", "at": {{"after_m": 4}}, "into": {{"name": "on", "direction": [1, 0, -1], "depth_m": 5{more}}}}}}}]}}}}"#
        )
    };
    let long = "n".repeat(WrittenCamera::MAX_NAME_BYTES + 1);
    let (sound, lost) = (bent("sound", "root", ""), bent("lost", "hall", ""));
    let one = bent("n", "root", "");
    let many: Vec<String> =
        (0..=WrittenCamera::MAX_CAMERAS).map(|k| one.replace(r#""n""#, &format!("\"n{k}\""))).collect();
    for (text, words) in [
        (format!("[{sound}, {lost}]"), ["\"lost\"", "frustum \"on\"", "\"hall\""].as_slice()),
        (bent("odd", "root", r#", "depth": 3"#), &["\"odd\"", "depth"]),
        (format!("[{sound}, {sound}]"), &["\"sound\"", "another"]),
        (bent(&long, "root", ""), &["nnn", "name"]),
        (bent("", "root", ""), &["name"]),
        (format!("[{}]", many.join(", ")), &["\"n256\"", "256 cameras"]),
        (r#"{"name": "none"}"#.to_owned(), &["\"none\"", "exactly one"]),
        (r#"{"name": "dragon", "single_pole": {"eye": [0, 1, 4], "target": "dragon", "size_px": [9, 9], "ring_m": 1}}"#.to_owned(),
            &["\"dragon\"", "no object"]),
        ("[7]".to_owned(), &["\"\""]),
        (sound[..sound.len() / 2].to_owned(), &["EOF"]),
        ("[".repeat(100_000), &["recursion"]),
        (" ".repeat((16 << 20) + 1), &["longer"]),
    ] {
        let error = refusal(&text);
        assert!(words.iter().all(|word| error.contains(word)), "{error:?} does not say {words:?}");
    }
    let error = cameras::add(&mut scene::builtin::load("pillars").expect("built in"), &PathBuf::from("/nowhere.json"));
    assert!(error.expect_err("no file").to_string().contains("/nowhere.json: cannot be read"));
}
