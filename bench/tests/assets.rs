//! Checks against other systems' published figures and frames, in the folder that `VANTAGE_ASSETS` names; without it they
//! count as ignored.

use std::path::{Path, PathBuf};

use camera::Pinhole;
use glam::{DAffine3, DQuat, DVec2, DVec3};
use gpu::Gpu;
use libtest_mimic::{Arguments, Failed, Trial};
use server::impostors::{Choices, Needs};
use vantage_bench::compare::{Picture, score};
use vantage_bench::render::read_trace;
use vantage_bench::stage::{Stage, load_scene, picture};
use vantage_bench::topics::novel_views::peers::PEERS;
use vantage_bench::topics::novel_views::setup::{QUASAR_2025, quasar_2025, read_seen};

/// A picture with the reference on its left and another system's frame on its right: file, scene, and frame.
const EXAMPLES: [(&str, &str, usize); 3] = [
    ("pillars-frame090-reference-quasar.png", "pillars", 90),
    ("interior-frame070-reference-quasar.png", "interior", 70),
    ("city-frame055-reference-quasar.png", "city", 55),
];

/// Published figures have four decimals; implementations differ in the last.
const TOLERANCE: f64 = 1e-3;

/// Given the folder of assets.
type Check = Box<dyn FnOnce(&Path) -> Result<(), Failed> + Send>;

fn main() {
    let assets = std::env::var_os("VANTAGE_ASSETS").map(PathBuf::from);
    let mut trials = Vec::new();
    let mut add = |name: String, check: Check| {
        let folder = assets.clone();
        let run = move || check(&folder.ok_or("VANTAGE_ASSETS is not set")?);
        trials.push(Trial::test(name, run).with_ignored_flag(assets.is_none()));
    };
    for (file, scene, frame) in EXAMPLES {
        add(
            format!("flip_equals_the_published_figure::{scene}"),
            Box::new(move |assets| flip_equals_the_published_figure(assets, file, scene, frame)),
        );
        add(
            format!("the_truth_is_their_reference::{scene}"),
            Box::new(move |assets| the_truth_is_their_reference(assets, file, scene, frame)),
        );
        add(
            format!("a_trace_is_read_as_it_was_seen::{scene}"),
            Box::new(move |assets| a_trace_is_read_as_it_was_seen(assets, scene)),
        );
    }
    add("a_mirror_in_a_real_interior_is_served".to_owned(), Box::new(a_mirror_in_a_real_interior_is_served));
    add("the_table_of_peers_is_the_published_one".to_owned(), Box::new(the_table_of_peers_is_the_published_one));
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

fn halves(assets: &Path, file: &str) -> Result<(Picture, Picture), Failed> {
    let both = Picture::read(&assets.join("peers/examples").join(file))?;
    let width_px = both.width_px / 2;
    Ok((both.columns(0, width_px), both.columns(width_px, width_px)))
}

fn flip_equals_the_published_figure(assets: &Path, file: &str, scene: &str, frame: usize) -> Result<(), Failed> {
    let (truth, shown) = halves(assets, file)?;
    let text = std::fs::read_to_string(assets.join("peers/per_frame.json"))?;
    let figures: serde_json::Value = serde_json::from_str(&text)?;
    let published = figures[format!("{scene}_qr")]["flip"][frame].as_f64().ok_or("no such figure")?;
    let found = score(&shown, &truth, None)?.flip;
    println!("{scene} frame {frame}: {found:.4}, published {published:.4}");
    near(found, published, TOLERANCE, "FLIP")
}

/// Camera, scale, light and textures are theirs. In their frames of `pillars` textures stand on their heads, which glTF does not
/// ask for and the other scenes do not show.
fn the_truth_is_their_reference(assets: &Path, file: &str, scene: &str, frame: usize) -> Result<(), Failed> {
    let (reference, _) = halves(assets, file)?;
    let mut replay = quasar_2025(scene, assets, None)?;
    if scene == "pillars" {
        let vertices = replay.scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices);
        vertices.for_each(|vertex| vertex.uv[1] = 1.0 - vertex.uv[1]);
    }
    let gpu = Gpu::block_on(Gpu::new_headless())?;
    let eye = replay.trace.poses[frame].world_from_eye;
    let camera = Pinhole::symmetric(eye, replay.size_px, replay.fov_y_rad, server::start::near_m(&replay.scene));
    let mut stage = Stage::new(&gpu, replay.scene, replay.look)?;
    stage.show(0.0, eye.translation)?;
    let truth = stage.truth(&camera)?;
    let nearest_m = 1.0 / f64::from(truth.w.iter().copied().fold(0.0, f32::max));
    let scores = score(&picture(&truth), &reference, None)?;
    println!("{scene} frame {frame}: {scores:?}, nearest {nearest_m:.2} m");
    if let Some(folder) = std::env::var_os("VANTAGE_TEST_PICTURES") {
        picture(&truth).write(&PathBuf::from(folder).join(format!("{scene}-{frame}-truth.png")))?;
    }
    // Their near plane is at 0.1 m.
    if nearest_m < 0.1 {
        return Err(format!("something is {nearest_m} m away").into());
    }
    near(scores.flip, 0.0, MOST_REFERENCE_FLIP, "FLIP")
}

/// Texture filters, the rounding of poses, and walls of `city` that are up to 7 of 255 darker there.
const MOST_REFERENCE_FLIP: f64 = 0.04;

/// Rooms and stairs, not corridors of one width: a mirror stands there, is given six images, and the reason names them.
fn a_mirror_in_a_real_interior_is_served(assets: &Path) -> Result<(), Failed> {
    let interior = load_scene(&assets.join("scenes/gltf/zdm2-interior.glb").to_string_lossy(), 1.0)?;
    let pot = scene::builtin::load("teapots").ok_or("no pot")?;
    let pot = pot.meshes.into_iter().max_by_key(|mesh| mesh.indices.len()).ok_or("no mesh")?;
    let silver = scene::Material { metallic: 1.0, roughness: 0.0, ..scene::Material::default() };
    let middle = interior.bounds.centre();
    let below = scene::heights_m(&interior, &interior.at(0.0), None, &[DVec2::new(middle.x, middle.z)], middle.y);
    let at = middle.with_y(below[0].0);
    if !at.is_finite() {
        return Err("nothing is below the middle".into());
    }
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(3.0), DQuat::IDENTITY, at);
    let scene = interior.with("mirror", pot, silver, place);
    let decision =
        Needs::new(&scene).decide(&scene, &scene.at(0.0), at + DVec3::new(1.0, 0.5, 1.0), &Choices::default());
    println!("{:?}", decision.reasons);
    let is_said =
        decision.reasons.iter().any(|reason| reason.contains("\"mirror\" is a mirror") && reason.contains("6 images"));
    if is_said { Ok(()) } else { Err(format!("{:?}", decision.reasons).into()) }
}

/// `Ry(ry) Rx(rx)` of the recorded angles is the quaternion that was drawn; poses are rounded to 1e-5 m and 1e-4 degrees,
/// their times to milliseconds.
fn a_trace_is_read_as_it_was_seen(assets: &Path, scene: &str) -> Result<(), Failed> {
    let file = |kind: &str| assets.join(format!("peers/traces/{scene}-{kind}.txt"));
    let (walk, seen) = (read_trace(&file("walk"))?, read_seen(&file("seen"))?);
    for pose in &seen.poses {
        let read = walk.at(pose.t_s);
        near(read.translation.distance(pose.world_from_eye.translation), 0.0, 2e-3, "metres")?;
        near(read.rotation.angle_between(pose.world_from_eye.rotation).to_degrees(), 0.0, 0.1, "degrees")?;
    }
    Ok(())
}

fn the_table_of_peers_is_the_published_one(assets: &Path) -> Result<(), Failed> {
    let text = std::fs::read_to_string(assets.join("peers/results.json"))?;
    let published: serde_json::Value = serde_json::from_str(&text)?;
    let rows = published["rows"].as_array().ok_or("no rows")?;
    near(PEERS.len() as f64, rows.len() as f64, 0.0, "rows")?;
    for peer in PEERS {
        let row = rows.iter().find(|row| row["run"] == peer.run).ok_or_else(|| format!("no run {}", peer.run))?;
        let triples =
            [("flip", peer.flip), ("ssim", peer.ssim), ("psnr_db", peer.psnr_db), ("holes_fraction", peer.holes_share)];
        for (measure, triple) in triples {
            for (part, found) in ["mean", "p95", "worst"].into_iter().zip(triple) {
                let value = row[measure][part].as_f64().ok_or("no figure")?;
                near(found, value, if measure == "psnr_db" { 5.1e-3 } else { 5.1e-5 }, measure)?;
            }
        }
        near(peer.geometry_mbit_s, row["mbps_geometry_true"].as_f64().ok_or("no bytes")?, 0.051, "Mbit/s")?;
        near(peer.round_trip_ms.0, row["rtt_ms_measured"]["mean"].as_f64().ok_or("no round trip")?, 0.051, "ms")?;
        near(peer.frames as f64, row["frames"].as_f64().ok_or("no frames")?, 0.0, "frames")?;
        if !QUASAR_2025.contains(&peer.scene) || row["scene"] != peer.scene {
            return Err(format!("{} is of {}", peer.run, row["scene"]).into());
        }
    }
    Ok(())
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) -> Result<(), Failed> {
    if (found - expected).abs() <= tolerance { Ok(()) } else { Err(format!("{what}: {found}, not {expected}").into()) }
}
