//! What impostors are worth: reflections and refractions drawn by a client from what a server sends, against a traced truth; what
//! rays cost; how much of an object an image holds; and what a session spends on it.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 7; the figures beside ours are
//! theirs.

mod coverage;
pub(in crate::topics) mod ground;
pub mod occlusion;
mod output;
mod reflect;
mod relief;
mod rough;
mod settings;
mod sizes;
mod steps;
mod streamed;
mod times;
mod walks;

use anyhow::Context;
use clap::Args;
use gpu::Gpu;
use scene::Scene;
use server::impostors::Needs;

use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use settings::{Arguments, Settings};

/// See the module.
pub struct Impostors;

impl Topic for Impostors {
    fn name(&self) -> &'static str {
        "impostors"
    }

    fn about(&self) -> &'static str {
        "Mirrors and glass as a client draws them from the images that a server decides to send: error against a traced truth and time \
         by images of every kind, steps of rays, what an image holds of an object, and bytes of a session, beside the papers' figures."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        let scenes =
            ["mirror-teapots", "glass-teapots", "mirror-maze-moving", "mirror-pair", "chrome-car", "lake", "barrels"];
        scenes.map(str::to_owned).to_vec()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let settings = Settings::of(run, &run.arguments()?);
        let gpu = run.gpu(report)?.clone();
        output::describe(report, &settings);
        for name in &run.scenes {
            if let Err(error) = scene(&gpu, name, &settings, run, report) {
                report.rows.push(Row::failed(&scene_label(name), "all", &error));
            }
        }
        if !settings.only_errors && !settings.walks {
            coverage::measure(&gpu, run, report)?;
            relief::measure(&gpu, &settings, report)?;
        }
        output::tables(report);
        output::bars(report);
        Ok(())
    }
}

/// Ambient occlusion by both kinds of z-buffers.
fn steady(gpu: &Gpu, scene: Scene, settings: &Settings, report: &mut Report) -> anyhow::Result<()> {
    let label = scene.name.clone();
    let table = occlusion::stability(gpu, scene, &settings.occlusion)?;
    output::occlusion(&label, &table, &settings.occlusion, report);
    Ok(())
}

/// Of a scene in which something reflects, what reflections are worth; of one where rough metals do in the full look, what these are; of another one,
/// ambient occlusion.
fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let scene = run.load(name).with_context(|| name.to_owned())?;
    let label = scene.name.clone();
    if Needs::new(&scene).is_nothing() && !Needs::under_sky(&scene).is_nothing() {
        let walk = reflect::Path::of(&scene, run.read_trace()?, settings.poses);
        return rough::measure(gpu, &scene, &walk, settings, run, report);
    }
    if Needs::new(&scene).is_nothing() {
        let is_file = std::path::Path::new(name).exists();
        return steady(gpu, if is_file { ground::grounded(scene) } else { scene }, settings, report);
    }
    let walk = reflect::Path::of(&scene, run.read_trace()?, settings.poses);
    if settings.walks {
        return walks::measure(gpu, &scene, &walk, settings, report);
    }
    reflect::measure(gpu, &scene, &walk, settings, run, report)?;
    if !settings.only_errors {
        times::measure(gpu, &scene, &walk, settings, report)?;
        steps::measure(gpu, &scene, &walk, settings, report)?;
        streamed::measure(gpu, &scene, &walk, settings, report)?;
    }
    output::plot(&label, run, report)
}
