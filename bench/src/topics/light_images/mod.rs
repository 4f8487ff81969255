//! Topic `light-images`: shadows of every light in a session, by what lights see and by what the eye saw alone.
//!
//! A viewer walks out and back, served by the real stage without a network, and draws hard shadows of the scene's lights from what is held. Truths are
//! rays, and one shadow map of the full geometry for each light. Objects that reliefs show are there beside the same objects as samples.

mod output;
mod settings;
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
use settings::{Arguments, Settings};
use truth::{Seen, Truths};
use way::{WAYS, Way};

/// See the module.
pub struct LightImages;

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
        let settings = Settings::of(run)?;
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
