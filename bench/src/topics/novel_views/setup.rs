//! What is replayed: scene, trace, view and networks, as asked for or as a protocol that other systems were measured by says.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use camera::{Rigid, Trace, TracePose};
use glam::{DQuat, DVec3};
use network::Link;
use protocol::Look;
use scene::model::Animation;
use scene::{Mesh, Scene, Snapshot};

use crate::poses::stroll;
use crate::render::read_trace;
use crate::stage::load_scene;

/// Pictures a second of the client.
pub const CLIENT_HZ: f64 = 60.0;
/// Ticks a second of the server.
pub const SERVER_HZ: f64 = 30.0;

/// One scene with the way of the eye through it.
pub struct Replay {
    /// The scene's short name.
    pub label: String,
    /// As loaded.
    pub scene: Scene,
    /// How colour is shown.
    pub look: Look,
    /// A pose a picture, at [`CLIENT_HZ`].
    pub trace: Trace,
    /// Width and height of the pictures.
    pub size_px: (u32, u32),
    /// Of the pictures.
    pub fov_y_rad: f64,
    /// The networks to replay it over; the first is the main one.
    pub networks: Vec<Network>,
}

/// A network that is emulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// For people.
    pub name: String,
    /// What it does.
    pub link: Link,
}

impl Network {
    /// A link as `--network` takes it.
    pub fn of_link(link: Link) -> Network {
        Network { name: link.to_string(), link }
    }
}

/// A scene or a trace of one's own.
pub fn own(
    scene: &str,
    trace: Option<&Path>,
    size_px: Option<(u32, u32)>,
    frames: Option<usize>,
) -> anyhow::Result<Replay> {
    let label = crate::topic::scene_label(scene);
    let scene = load_scene(scene, 1.0)?;
    let trace = match trace {
        Some(path) if path.as_os_str() != "auto" => read_trace(path)?,
        _ => stroll(&scene),
    };
    Ok(Replay {
        label,
        trace: a_pose_a_picture(&trace, frames),
        scene,
        look: Look::Plain,
        size_px: size_px.unwrap_or((640, 360)),
        fov_y_rad: 60_f64.to_radians(),
        networks: vec![Network::of_link(Link { rtt_s: 0.1, jitter_s: 0.02, ..Link::default() })],
    })
}

/// A motion through a scene, whose trace is a motion's; `held_at_s`: the time at which an animated scene is held.
pub fn moving(scene: &str, size_px: Option<(u32, u32)>, held_at_s: Option<f64>) -> anyhow::Result<Replay> {
    let replay = own(scene, None, size_px, None)?;
    let scene = match held_at_s {
        Some(time_s) => held_at(replay.scene, time_s),
        None => replay.scene,
    };
    Ok(Replay { scene, ..replay })
}

/// An animated scene as a still one: as it is at a time.
pub fn held_at(mut scene: Scene, time_s: f64) -> Scene {
    let snapshot = scene.at(time_s);
    for deformed in snapshot.deformed {
        let instance = &mut scene.instances[deformed.instance as usize];
        let mesh = Mesh { vertices: deformed.vertices, ..scene.meshes[instance.mesh as usize].clone() };
        instance.mesh = scene.meshes.len() as u32;
        scene.meshes.push(mesh);
    }
    for instance in &mut scene.instances {
        (instance.moves, instance.deforms) = (false, false);
    }
    scene.lights_move = false;
    scene.animation = Arc::new(Held(Snapshot { deformed: Vec::new(), ..snapshot }));
    scene
}

/// The same at all times.
struct Held(Snapshot);

impl Animation for Held {
    fn at(&self, _scene: &Scene, time_s: f64) -> Snapshot {
        Snapshot { time_s, ..self.0.clone() }
    }
}

/// The trace at the very times of the pictures, from its first pose on.
pub fn a_pose_a_picture(trace: &Trace, frames: Option<usize>) -> Trace {
    // A picture that the rounding of milliseconds puts just past the end still counts.
    let whole = (trace.duration_s() * CLIENT_HZ + 0.01).floor() as usize + 1;
    at_the_pictures((0..frames.unwrap_or(whole).max(1)).map(|index| trace.at(index as f64 / CLIENT_HZ)))
}

fn at_the_pictures(poses: impl Iterator<Item = Rigid>) -> Trace {
    let pose = |(index, world_from_eye)| TracePose { t_s: index as f64 / CLIENT_HZ, world_from_eye };
    Trace { poses: poses.enumerate().map(pose).collect() }
}

/// The scenes of [`quasar_2025`].
pub const QUASAR_2025: [&str; 3] = ["pillars", "interior", "city"];

/// One of the scenes that QUASAR (Lu and Rowe, SIGGRAPH 2025) and its baselines were run on, in the same way: 640x360 pixels,
/// 60 degrees, 60 pictures and 30 updates a second, the 150 poses that they drew.
///
/// Their simulator delays a pose by `latency +- jitter` on its way up and again before it is used, and lets poses leave and
/// be used at the server's ticks alone, so that a round trip takes 98.6 +- 3.8 ms at 20 +- 10 ms and 163 +- 8 ms at
/// 50 +- 20 ms. Our client sends a pose with every picture; our links have their jitter, and the delay that brings our mean
/// round trip, from a pose's sending to the first picture that uses what it brought, to theirs.
pub fn quasar_2025(name: &str, assets: &Path, frames: Option<usize>) -> anyhow::Result<Replay> {
    let peers = assets.join("peers");
    let (file, scale, look) = match name {
        "pillars" => (peers.join("scenes/pillars.glb"), 1.0, Look::Flat),
        "interior" => (peers.join("scenes/interior.glb"), 1.0, Look::FlatLit),
        "city" => (assets.join("scenes/gltf/city-kaykit-31x31.glb"), 4.0, Look::FlatLit),
        _ => bail!("{name} is not one of {}", QUASAR_2025.join(", ")),
    };
    let scene = load_scene(&file.to_string_lossy(), scale)?;
    let seen = read_seen(&peers.join(format!("traces/{name}-seen.txt")))?;
    let count = frames.unwrap_or(seen.poses.len()).clamp(1, seen.poses.len());
    let network = |latency_ms, rtt_s, jitter_s| Network {
        name: latency_name(latency_ms),
        link: Link { rtt_s, jitter_s, ..Link::default() },
    };
    let mut networks = vec![network(20, 0.082, 0.020)];
    if name == "pillars" {
        networks.push(network(50, 0.144, 0.040));
    }
    Ok(Replay {
        label: name.to_owned(),
        scene,
        look,
        trace: at_the_pictures(seen.poses[..count].iter().map(|pose| pose.world_from_eye)),
        size_px: (640, 360),
        fov_y_rad: 60_f64.to_radians(),
        networks,
    })
}

/// How a latency of their simulator is called.
pub fn latency_name(latency_ms: u32) -> String {
    match latency_ms {
        20 => "20 +- 10 ms".to_owned(),
        50 => "50 +- 20 ms".to_owned(),
        _ => format!("{latency_ms} ms"),
    }
}

/// The folder with the other systems' scenes, traces and figures.
pub fn assets() -> anyhow::Result<PathBuf> {
    let assets = std::env::var_os("VANTAGE_ASSETS").map(PathBuf::from);
    assets.context("the protocol's scenes and traces are not in this repository: set VANTAGE_ASSETS to their folder")
}

/// Reads poses as drawn, a line each: `t_s px py pz qx qy qz qw`, seconds, metres, camera to world of a camera that looks
/// along -z with y up.
pub fn read_seen(path: &Path) -> anyhow::Result<Trace> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let pose = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
        let &[t_s, px, py, pz, qx, qy, qz, qw] = numbers.as_slice() else { return None };
        let world_from_gl = DQuat::from_xyzw(qx, qy, qz, qw).normalize();
        Some(TracePose { t_s, world_from_eye: Rigid::from_gl(DVec3::new(px, py, pz), world_from_gl) })
    };
    let poses: Option<Vec<_>> = text.lines().map(pose).collect();
    let poses = poses.filter(|poses| !poses.is_empty() && poses.iter().all(|pose| pose.world_from_eye.is_valid()));
    Ok(Trace { poses: poses.with_context(|| format!("{}: not eight finite numbers a line", path.display()))? })
}
