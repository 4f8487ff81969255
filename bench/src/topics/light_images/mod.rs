//! Topic `light-images`: shadows of every light in a session, by what lights see and by what the eye saw alone.
//!
//! A viewer walks out and back, served by the real stage without a network, and draws hard shadows of the scene's lights from what is held. Truths are
//! rays, and one shadow map of the full geometry for each light. Objects that reliefs show are there beside the same objects as samples.

mod output;
mod truth;
mod way;

use std::sync::Arc;

use clap::Args;
use gpu::Gpu;
use scene::Scene;

use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use crate::topics::sent_once::walk::{UPDATE_HZ, Walk};
use truth::{Seen, Truths};
use way::{WAYS, Way};

/// See the module.
pub struct LightImages;

/// Seconds out, and as many back.
const HALF_S: f64 = 4.0;
const QUICK_HALF_S: f64 = 0.8;
/// Views of the walk that are compared.
const POSES: usize = 12;
const QUICK_POSES: usize = 2;
/// Sides of server views and of the output.
const SIDES_PX: (u32, u32) = (512, 360);
const QUICK_SIDES_PX: (u32, u32) = (256, 128);

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Views of the walk that are compared [default: 12, with --quick 2].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    poses: Option<u32>,
    /// Seconds out, and as many back [default: 4, with --quick 0.8].
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Side of the server's images in pixels [default: 512, with --quick 256].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(128..=4096))]
    image_size: Option<u32>,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|seconds| (0.1..=600.0).contains(seconds)).ok_or_else(|| "from 0.1 to 600".to_owned())
}

/// What is walked, and how it is looked at.
struct Settings {
    half_s: f64,
    poses: usize,
    image_px: u32,
    output_px: u32,
}

impl Topic for LightImages {
    fn name(&self) -> &'static str {
        "light-images"
    }

    fn about(&self) -> &'static str {
        "Hard shadows of every light while a viewer walks: errors against rays and against shadow maps of the full geometry, bytes and times, by what lights see and by \
         what the eye saw alone; objects by reliefs beside the same objects as samples."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let scenes: &[&str] = if quick { &["urban"] } else { &["urban", "cars", "barrels"] };
        scenes.iter().map(|&name| name.to_owned()).collect()
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let arguments: Arguments = run.arguments()?;
        let (image_px, output_px) = if run.quick { QUICK_SIDES_PX } else { SIDES_PX };
        let settings = Settings {
            half_s: arguments.seconds.unwrap_or(if run.quick { QUICK_HALF_S } else { HALF_S }),
            poses: arguments.poses.map_or(if run.quick { QUICK_POSES } else { POSES }, |poses| poses as usize),
            image_px: arguments.image_size.unwrap_or(image_px),
            output_px: run.size_px.map_or(output_px, |(_, height_px)| height_px),
        };
        output::describe(report, &settings);
        for name in &run.scenes {
            if let Err(error) = scene(&gpu, name, &settings, run, report) {
                report.rows.push(Row::failed(&scene_label(name), "walk", &error));
            }
        }
        output::add(report);
        Ok(())
    }
}

/// All ways along one walk, beside the same truths.
fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let scene: Arc<Scene> = Arc::new(run.load(name)?);
    let walk = Walk::new(&scene, run.read_trace()?, settings.half_s);
    let ticks = (2.0 * settings.half_s * UPDATE_HZ) as usize;
    let every = (ticks / settings.poses).max(1);
    let progress = Progress::new(format!("{}: truths", scene_label(name)), settings.poses as u64);
    let mut truths = Truths::new(gpu, &scene)?;
    let mut seen: Vec<(usize, Seen)> = Vec::new();
    for tick in (every..=ticks).step_by(every) {
        let at_s = tick as f64 / UPDATE_HZ;
        seen.push((tick, truths.at(at_s, &settings.output(&scene, walk.at(at_s)))?));
        progress.step();
    }
    drop(progress);
    let ways: Vec<&Way> = WAYS.iter().filter(|way| way.is_of(&scene)).collect();
    let progress = Progress::new(format!("{}: walks", scene_label(name)), ways.len() as u64);
    for way in ways {
        progress.say(way.name);
        let walked = way.walk(gpu, &scene, (&walk, ticks), &seen, settings)?;
        output::pictures(name, way, &walked, &seen, run, report)?;
        report.rows.push(output::row(&scene_label(name), way, &walked));
        progress.step();
    }
    Ok(())
}
