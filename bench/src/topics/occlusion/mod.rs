//! Topic `occlusion`: ambient occlusion in a session: how steady while a viewer walks, and how near the truth.
//!
//! A viewer goes out and back, served by the real stage without a network. Points of what he sees are followed by the pixels that show
//! them. Nothing but the eye moves, so a point's occlusion should not change; the truth is ray traced through the scene itself
//! (*Non-pinhole approximations for interactive rendering*, section 6.3, names the flicker and gives no figure).

mod output;
pub mod points;
mod settings;
mod way;

use std::path::Path;
use std::sync::Arc;

use camera::Pinhole;
use clap::Args;
use gpu::Gpu;
use protocol::{DepthImage, Look};
use scene::Scene;
use server::discretize::{DepthPrecision, Discretization, Discretizer};

use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::stage::Stage;
use crate::topic::{Run, Topic, scene_label};
use crate::topics::impostors::ground::grounded;
use crate::topics::sent_once::walk::{UPDATE_HZ, Walk};
use points::{Point, mean};
use settings::{Arguments, Settings};
use way::{SESSIONS, Session, Walked, Way};

/// Share of the frames that must show a point, in every session.
const LEAST_SHOWN: f64 = 0.25;
/// Views of the walk that points are taken from.
const POINT_VIEWS: usize = 6;

/// See the module.
pub struct Occlusion;

impl Topic for Occlusion {
    fn name(&self) -> &'static str {
        "occlusion"
    }

    fn about(&self) -> &'static str {
        "Ambient occlusion while a viewer walks in a session: how steady, how near to rays, bytes and times; by the view's own z-buffer, by graph cameras of what the eye saw, \
         and with the occluders that a server sends."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let scenes: &[&str] = if quick { &["barrels"] } else { &["barrels", "urban"] };
        scenes.iter().map(|&name| name.to_owned()).collect()
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let settings = Settings::of(run)?;
        output::describe(report, &settings);
        for name in &run.scenes {
            if let Err(error) = scene(&gpu, name, &settings, run, report) {
                report.rows.push(Row::failed(&scene_label(name), "walk", &error));
            }
        }
        output::add(report, &settings);
        Ok(())
    }
}

/// All sessions along one walk, beside the same truth.
fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let scene = run.load(name)?;
    let scene = Arc::new(if Path::new(name).is_file() && !scene.walk { grounded(scene) } else { scene });
    anyhow::ensure!(!scene.is_animated(), "something moves in it");
    let walk = Walk::new(&scene, run.read_trace()?, settings.half_s);
    let ticks = (2.0 * settings.half_s * UPDATE_HZ) as usize;
    let every = (ticks / settings.poses).max(1);
    let frame = |tick: usize| (tick, settings.output(&scene, walk.at(tick as f64 / UPDATE_HZ)));
    let frames: Vec<(usize, Pinhole)> = (every..=ticks).step_by(every).map(frame).collect();
    let reach_m = settings::reach_m(&scene);
    let (points, traced) = truth(gpu, &scene, &frames, reach_m, settings)?;
    let sessions: Vec<Session> = SESSIONS.into_iter().filter(|session| session.is_of(&scene)).collect();
    let progress = Progress::new(format!("{}: sessions", scene_label(name)), sessions.len() as u64);
    let mut walked: Vec<(Vec<Way>, Walked)> = Vec::new();
    for session in sessions {
        progress.say(session.name);
        let ways = session.ways(&settings.taps);
        let found = way::walk(gpu, &scene, (session, &ways), (&walk, &frames), (&points, reach_m), settings)?;
        walked.push((ways, found));
        progress.step();
    }
    let least = LEAST_SHOWN * frames.len() as f64;
    let is_shown =
        |(_, of): &(Vec<Way>, Walked), point: usize| of.shares[0][point].iter().flatten().count() as f64 >= least;
    let followed: Vec<usize> =
        (0..points.len()).filter(|&point| walked.iter().all(|session| is_shown(session, point))).collect();
    anyhow::ensure!(!followed.is_empty(), "no point is seen often enough");
    output::rows(&scene_label(name), (&walked, &traced, &followed), reach_m, report);
    Ok(())
}

/// Points that the walk sees, and the shares of the sky that they see.
fn truth(
    gpu: &Gpu,
    scene: &Arc<Scene>,
    frames: &[(usize, Pinhole)],
    reach_m: f64,
    settings: &Settings,
) -> anyhow::Result<(Vec<Point>, Vec<f64>)> {
    let mut stage = Stage::new(gpu, (**scene).clone(), Look::default())?.with_rays();
    // Out and back shows the same.
    let out = &frames[..frames.len().div_ceil(2)];
    let every = out.len().div_ceil(POINT_VIEWS).max(1);
    let views: Vec<Pinhole> = out.iter().step_by(every).map(|(_, view)| *view).collect();
    stage.show(0.0, views[0].world_from_eye.translation)?;
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let mut images: Vec<DepthImage> = Vec::new();
    for view in &views {
        let captures = discretizer.run(&stage.renderer, &[*view], Discretization::Conventional)?.wait()?;
        images.extend(captures.iter().map(|capture| capture.depth_image(DepthPrecision::Finest)));
    }
    let points = points::points(&images, settings.points);
    anyhow::ensure!(!points.is_empty(), "nothing smooth is seen");
    let rays = stage.renderer.rays().expect("asked for above");
    let anchor_world = stage.renderer.anchor_world();
    let traced: Vec<f64> = points.iter().map(|point| points::traced(rays, anchor_world, point, reach_m)).collect();
    tracing::debug!(points = points.len(), traced = mean(traced.iter().copied()), "points to follow");
    Ok((points, traced))
}
