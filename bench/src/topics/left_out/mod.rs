//! Topic `left-out`: what a scene does not need is left out; each thing of it forced in beside it, and all of it at once.
//!
//! The real server and the headless viewer run over a real socket and an emulated network, on the virtual clock, along the same motion each time. What is
//! forced in is made and sent although the scene or the client has no use for it: the picture should be no better for it.

mod apart;
mod forced;

use std::path::Path;

use gpu::Gpu;
use network::Link;

use crate::motion::{self, Motion, ORBIT_S};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use crate::topics::novel_views::live::{self, Lived};
use crate::topics::novel_views::setup::{self, CLIENT_HZ, Network, Replay};
use crate::topics::novel_views::truths::{Truths, paired, scored};
use forced::{Forced, THINGS};

/// See the module.
pub struct LeftOut;

/// Of the built-in scenes that a person would show.
const BUILT_IN: &[&str] = &[
    "pillars",
    "pillars-moving",
    "maze",
    "maze-moving",
    "urban",
    "tree",
    "grass",
    "birdnest",
    "barrels",
    "cars",
    "teapots",
    "window",
    "mirror-teapots",
    "glass-teapots",
    "lake",
];
const QUICK_BUILT_IN: &[&str] = &["pillars", "maze"];
/// Files below `VANTAGE_ASSETS`, where that is set.
const FILES: &[&str] = &[
    "gltf/Box.glb",
    "gltf/BoxTextured.glb",
    "gltf/2CylinderEngine.glb",
    "gltf/room-occlusion.glb",
    "gltf/Duck.glb",
    "gltf/CesiumMan.glb",
    "gltf/Fox.glb",
    "gltf/zdm2-interior.glb",
    "gltf/FlightHelmet/FlightHelmet.gltf",
    "obj/suzanne/suzanne.obj",
    "ply/dragon-23k.ply",
];
const QUICK_FILES: &[&str] = &["gltf/Box.glb", "gltf/2CylinderEngine.glb", "gltf/room-occlusion.glb"];
/// Of the motion: what is measured takes as long, and much of a scene comes into view.
const MEASURED_S: f64 = 3.0;
const QUICK_MEASURED_S: f64 = 2.0;
/// Bytes of all forced in that may be left, in the median of the scenes.
const MOST_BYTES_SHARE: f64 = 0.5;
/// By how much error may be larger than with everything.
const MOST_ERROR_RATIO: f64 = 1.02;

impl Topic for LeftOut {
    fn name(&self) -> &'static str {
        "left-out"
    }

    fn about(&self) -> &'static str {
        "What a scene does not need is left out: bytes, times, memory and error of each scene as the server decides, with each thing forced in that it \
         leaves out, and with all of them."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let (built_in, files) = if quick { (QUICK_BUILT_IN, QUICK_FILES) } else { (BUILT_IN, FILES) };
        let mut scenes: Vec<String> = built_in.iter().map(|&name| name.to_owned()).collect();
        if let Ok(assets) = setup::assets() {
            let path = |file: &&str| assets.join("scenes").join(Path::new(file)).to_string_lossy().into_owned();
            scenes.extend(files.iter().map(path));
        }
        scenes
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let measured_s = if run.quick { QUICK_MEASURED_S } else { MEASURED_S };
        describe(report, measured_s, run.quick);
        let progress = Progress::new("left-out", run.scenes.len() as u64);
        for scene in &run.scenes {
            progress.say(scene_label(scene));
            let rows = match run.scenes.len() {
                1 => measure(&gpu, scene, (run, measured_s)),
                _ => apart::rows(self.name(), run, scene),
            };
            let failed = |error| vec![Row::failed(&scene_label(scene), "as decided", &error)];
            report.rows.extend(rows.unwrap_or_else(failed));
            progress.step();
        }
        bars(report);
        Ok(())
    }
}

fn describe(report: &mut Report, measured_s: f64, quick: bool) {
    report
        .settings
        .set("motion", format!("walk, of objects orbit: {measured_s} s, a round trip of 100 ms with 20 ms of jitter"));
    report.settings.set("forced", if quick { "all at once" } else { "each by itself, and all at once" });
    let what = |thing: &&forced::Thing| format!("{}: {}.", thing.name, thing.what);
    report.notes = THINGS.iter().map(|thing| what(&thing)).collect();
    report.notes.extend(
        [
            "bytes.total: all that crossed the socket both ways, with headers of messages and frames, from the opening of the connection on.",
            "memory_mb: by how much this process grew, server and client together: rough, and of the first run of a scene the most.",
            "flip_covered: over pixels that the truth covers, of two of every ten pictures.",
        ]
        .map(str::to_owned),
    );
}

fn measure(gpu: &Gpu, scene: &str, (run, measured_s): (&Run, f64)) -> anyhow::Result<Vec<Row>> {
    let still = setup::moving(scene, run.size_px, None)?;
    let motion = if still.scene.walk { Motion::Walk } else { Motion::Orbit };
    let mut trace = match run.read_trace()? {
        Some(trace) => setup::a_pose_a_picture(&trace, None),
        None => motion::way(motion, &still.scene, ORBIT_S * 2.0, CLIENT_HZ).trace,
    };
    trace.poses.truncate((measured_s * CLIENT_HZ) as usize);
    let link = Link { rtt_s: 0.1, jitter_s: 0.02, ..Link::default() };
    let replay = Replay { trace, networks: vec![Network::of_link(link)], ..still };
    let mut truths = Truths::new(gpu, &replay, false)?;
    let singles = THINGS.iter().filter(|_| !run.quick).map(|thing| (thing.name.to_owned(), Forced::only(thing)));
    let all = ("everything".to_owned(), Forced::everything());
    let decided = ("as decided".to_owned(), Forced::default());
    let runs = std::iter::once(decided).chain(singles).chain([all]);
    let found = |(method, forced): (String, Forced)| {
        let lived = live::run(gpu, &replay, &forced.operation(link))?;
        row(&replay, &method, lived, &mut truths)
    };
    runs.map(found).collect()
}

fn row(replay: &Replay, method: &str, lived: Lived, truths: &mut Truths) -> anyhow::Result<Row> {
    let Lived { shown, summary, socket_bytes, start_ms, memory_bytes } = lived;
    let scores = scored(&paired(truths, shown)?, false)?;
    let mut row = Row::new(&replay.label, method);
    let flip: Vec<f64> = scores.iter().filter_map(|score| score.scores.flip_covered).collect();
    let band: Vec<f64> = scores.iter().filter_map(|score| score.scores.flip_band).collect();
    for (name, values) in [("flip_covered", &flip), ("flip_band", &band)] {
        Spread::of(values, Better::Lower).into_iter().for_each(|spread| row.error.set(name, spread));
    }
    let frames: Vec<f64> = summary.frames.iter().map(|frame| frame.ms.frame).collect();
    for (name, values) in [("server_update", &summary.header.server_ms), ("client_frame", &frames)] {
        Spread::of(values, Better::Lower).into_iter().for_each(|spread| row.time_ms.set(name, spread));
    }
    let server_ms: f64 = summary.header.server_ms.iter().sum();
    row.bytes.set("total", (socket_bytes.0 + socket_bytes.1) as f64);
    row.counts.set("server_ms_in_all", server_ms);
    row.counts.set("start_ms", start_ms);
    row.counts.set("memory_mb", memory_bytes as f64 / 1e6);
    row.counts.set("updates", summary.header.updates as f64);
    Ok(row)
}

/// Of each scene what is left of everything, and the bars.
fn bars(report: &mut Report) {
    let figure = |scene: &str, method: &str, path: &str| {
        let row = report.rows.iter().find(|row| row.scene == scene && row.method == method)?;
        row.figure(path)
    };
    let ratio = |scene: &str, path: &str| Some(figure(scene, "as decided", path)? / figure(scene, "everything", path)?);
    let mut scenes: Vec<String> = report.rows.iter().map(|row| row.scene.clone()).collect();
    scenes.dedup();
    let shares: Vec<(String, f64)> =
        scenes.iter().filter_map(|scene| Some((scene.clone(), ratio(scene, "bytes.total")?))).collect();
    let all: Vec<f64> = shares.iter().map(|(_, share)| *share).collect();
    let median = Spread::of(&all, Better::Lower).map(|spread| spread.median);
    let mut found = vec![Bar::at_most("bytes of everything, in the median", MOST_BYTES_SHARE, median, "share")];
    found.extend(scenes.iter().map(|scene| {
        let ratio = ratio(scene, "error.flip_covered.mean");
        Bar::at_most(format!("{scene}: error over that of everything"), MOST_ERROR_RATIO, ratio, "ratio")
    }));
    for row in report.rows.iter_mut().filter(|row| row.method == "as decided") {
        if let Some((_, share)) = shares.iter().find(|(scene, _)| *scene == row.scene) {
            row.counts.set("bytes_share_of_everything", *share);
        }
    }
    report.bars.extend(found);
}
