//! Topic `materials`: what materials of glTF cost and bring: the full look beside the plain one, in the same run.
//!
//! A set of images as the server makes it for a viewer who looks at a scene, and seeded eyes in the region that it was made for, as in
//! `reconstruction`. Three ways: the *plain look*; the *full look*; and the full look of materials that are everywhere what they are on the whole,
//! which shows what it is that the plane of materials brings. The truth of each eye is the full scene in the look, by the plain renderer.
//!
//! The bytes of that plane are found by taking it away: what the set costs with it, less what it costs where every sample has one material.
//!
//! How near the full look itself is to what glTF says of its materials, `rays` tells.

mod held;
mod rays;

use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use gpu::Gpu;
use protocol::held::{Edit, NextSteps, Update};
use protocol::wire::encode_update;
use protocol::{DepthImage, Look, Sky};
use server::coding::CodingRule;
use server::discretize::Discretizer;
use server::render::SceneRenderer;

use super::reconstruction::eyes::{self, Eye};
use crate::client_view::ClientView;
use crate::compare::score;
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::sets;
use crate::spread::{Better, Spread};
use crate::stage::{Stage, picture};
use crate::topic::{Run, Topic, scene_label};
use held::{PLAN, held_at};

/// See the module.
pub struct Materials;

/// Output where `--size` gives none.
const OUTPUT_PX: (u32, u32) = (512, 512);
const EYES: usize = 12;
const QUICK_EYES: usize = 3;
const SEED: u64 = 1;
/// Frames that are timed at each eye, after one that warms up.
const FRAMES: usize = 3;
/// What the plane of materials may cost, over the bytes of everything else.
const PLANE_BAR: f64 = 0.35;
/// The bar of `reconstruction`.
const FLIP_BAR: f64 = 0.06;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Eyes that look at each scene [default: 12, with --quick 3].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=4096))]
    eyes: Option<u64>,
}

/// A way to show a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Plain,
    Full,
    OnTheWhole,
}

impl Way {
    const ALL: [Way; 3] = [Way::Plain, Way::Full, Way::OnTheWhole];

    fn name(self) -> &'static str {
        match self {
            Way::Plain => "plain look",
            Way::Full => "full look",
            Way::OnTheWhole => "full look, materials on the whole",
        }
    }

    fn look(self) -> Look {
        if self == Way::Plain { Look::Plain } else { Look::Full }
    }
}

impl Topic for Materials {
    fn name(&self) -> &'static str {
        "materials"
    }

    fn about(&self) -> &'static str {
        "What materials of glTF cost and bring: bytes, server and client time and error of the full look, of the plain one, and of materials \
         that do not vary."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        // Whose materials do not vary: it must cost nothing.
        vec!["cars".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let arguments: Arguments = run.arguments()?;
        let eyes = arguments.eyes.map_or(if run.quick { QUICK_EYES } else { EYES }, |eyes| eyes as usize);
        measure(run, eyes, report)
    }
}

fn measure(run: &Run, eyes: usize, report: &mut Report) -> anyhow::Result<()> {
    let gpu = run.gpu(report)?.clone();
    let size_px = run.size_px.unwrap_or(OUTPUT_PX);
    report.settings.set("eyes", eyes);
    report.settings.set("seed", SEED);
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("images", format!("{} of {}x{}", PLAN.images, PLAN.image_px, PLAN.image_px));
    report.notes = [
        "Truth: the full scene with materials that vary, in the look of the way, one sample at each pixel's centre, by a renderer that shares nothing with the \
         reconstruction. Eyes as in `reconstruction`. Mirrors and glass show no impostors here.",
        "Bytes: the coded set; of the plane of materials, what the set costs less where all samples have one; of the sky, once a session.",
        "Beside rays: the same eyes, 256x256 or the output where that is smaller, where the materials of glTF are summed over 512 directions of each lobe, in f64, under the same studio, with nine rays a pixel, by code of its \
         own; once the plain renderer's picture of 16 samples a pixel, whose light is filtered beforehand as clients have it, once a client's frame.",
        "Times are wall times of this machine: server = an image with its readback, frame = drawing, lighting and filling, the median of three.",
    ]
    .map(str::to_owned)
    .to_vec();
    for name in &run.scenes {
        if let Err(error) = scene(&gpu, name, (size_px, eyes), run, report) {
            report.rows.push(Row::failed(&scene_label(name), "all", &error));
        }
    }
    Ok(())
}

fn scene(
    gpu: &Gpu,
    name: &str,
    (size_px, eyes): ((u32, u32), usize),
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let loaded = run.load(name)?;
    let label = loaded.name.clone();
    let mut view = ClientView::new(gpu, size_px)?;
    let progress = Progress::new(label.clone(), (Way::ALL.len() * eyes) as u64);
    let mut rows = Vec::new();
    let mut beside_rays = Vec::new();
    let rays_px = (size_px.0.min(rays::SIZE_PX.0), size_px.1.min(rays::SIZE_PX.1));
    for way in Way::ALL {
        progress.say(format!("{label}: {}", way.name()));
        let mut stage = Stage::new(gpu, loaded.clone(), way.look()).with_context(|| name.to_owned())?;
        let eyes = eyes::choose(&mut stage, run.read_trace()?.as_ref(), eyes, size_px, SEED)?;
        if way == Way::OnTheWhole {
            stage.renderer = SceneRenderer::new(gpu, &stage.scene)?;
            stage.renderer.update(&stage.scene.at(0.0), stage.scene.bounds.centre())?;
        }
        let mut discretizer = Discretizer::new(&stage.renderer)?;
        let found = eyes.iter().map(|eye| {
            progress.step();
            at_eye(gpu, &mut stage, &mut discretizer, &mut view, eye)
        });
        let found = found.collect::<anyhow::Result<Vec<Found>>>()?;
        rows.push(row(&label, way, &stage, &found));
        if way == Way::Full {
            progress.say(format!("{label}: rays"));
            beside_rays = rays::rows(gpu, (&mut stage, &mut discretizer), (&eyes, rays_px), &run.out, report)?;
        }
    }
    bars(&label, &rows, report);
    report.rows.extend(rows.into_iter().chain(beside_rays));
    Ok(())
}

/// What was found at one eye.
struct Found {
    flip_covered: f64,
    image_ms: f64,
    frame_ms: f64,
    samples: usize,
    bytes: usize,
    bytes_without_materials: usize,
}

fn at_eye(
    gpu: &Gpu,
    stage: &mut Stage,
    discretizer: &mut Discretizer,
    view: &mut ClientView,
    eye: &Eye,
) -> anyhow::Result<Found> {
    let (set, held) = held_at(gpu, stage, discretizer, eye)?;
    let drawn = view.frame(&held, &eye.output, Default::default())?;
    let frames = (0..FRAMES).map(|_| view.draw(&held, &eye.output, Default::default()));
    let frames_ms = frames.collect::<anyhow::Result<Vec<f64>>>()?;
    let coding = CodingRule::default().coding(None);
    let bytes = |images: &[DepthImage]| sets::encoded(images, coding).iter().map(Vec::len).sum();
    let mut settled = set.images.clone();
    settled.iter_mut().for_each(|image| coding.colour.settle_all(&mut image.colour));
    let mut without = settled.clone();
    without.iter_mut().for_each(|image| image.material.fill(0));
    Ok(Found {
        flip_covered: score(&drawn.picture, &picture(&eye.truth), None)?.flip_covered.unwrap_or(f64::NAN),
        image_ms: set.images_ms / set.images.len() as f64,
        frame_ms: Spread::of(&frames_ms, Better::Lower).context("frames")?.median,
        samples: set.images.iter().map(DepthImage::sample_count).sum(),
        bytes: bytes(&settled),
        bytes_without_materials: bytes(&without),
    })
}

fn row(label: &str, way: Way, stage: &Stage, found: &[Found]) -> Row {
    let mut row = Row::new(label, way.name());
    let values = |of: &dyn Fn(&Found) -> f64| found.iter().map(of).collect::<Vec<f64>>();
    if let Some(spread) = Spread::of(&values(&|found| found.flip_covered), Better::Lower) {
        row.error.set("flip_covered", spread);
    }
    let (server, client) = (values(&|found| found.image_ms), values(&|found| found.frame_ms));
    for (name, ms) in [("server_image", server), ("client_frame", client)] {
        if let Some(spread) = Spread::of(&ms, Better::Lower) {
            row.time_ms.set(name, spread);
        }
    }
    let mean = |of: &dyn Fn(&Found) -> f64| values(of).iter().sum::<f64>() / found.len().max(1) as f64;
    row.bytes.set("set", mean(&|found| found.bytes as f64));
    row.bytes.set("materials_plane", mean(&|found| found.bytes as f64 - found.bytes_without_materials as f64));
    row.bytes.set("sky", stage.sky().map_or(0, sky_bytes) as f64);
    row.counts.set("samples", mean(&|found| found.samples as f64).round());
    row.counts.set("materials", stage.renderer.materials().len() as f64);
    row
}

/// What a client is sent of a sky.
fn sky_bytes(sky: &Arc<Sky>) -> usize {
    let bytes = |edits| {
        let update = Update { number: 1, scene_time_s: 0.0, pose_seq: 0, edits, next: NextSteps::default(), digest: 0 };
        encode_update(&update, CodingRule::default().coding(None)).bytes.len()
    };
    bytes(vec![Edit::Sky(sky.clone())]) - bytes(Vec::new())
}

fn bars(label: &str, rows: &[Row], report: &mut Report) {
    let of = |way: Way, path: &str| rows.iter().find(|row| row.method == way.name())?.figure(path);
    let plane = of(Way::Full, "bytes.materials_plane");
    let rest = of(Way::Full, "bytes.set").zip(plane).map(|(set, plane)| set - plane);
    let share = plane.zip(rest).map(|(plane, rest)| plane / rest);
    report.bars.push(Bar::at_most(
        format!("{label}: bytes of the plane of materials, of all others"),
        PLANE_BAR,
        share,
        "",
    ));
    let flip = of(Way::Full, "error.flip_covered.mean");
    report.bars.push(Bar::at_most(format!("{label}: FLIP over covered pixels, full look, mean"), FLIP_BAR, flip, ""));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn what_does_not_vary_costs_no_byte() {
        let out = scratch_folder("materials");
        let mut run = Run::new(vec!["cars".to_owned()], out.clone());
        run.size_px = Some((96, 64));
        let mut report = Report::new("materials", "");
        measure(&run, 1, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let bytes = |row: usize, name: &str| report.rows[row].figure(&format!("bytes.{name}")).expect(name);
        assert_eq!(bytes(0, "set"), bytes(1, "set"), "the plain and the full look");
        assert!(bytes(1, "sky") > 0.0 && bytes(0, "sky") == 0.0);
        assert_eq!(report.bars.len(), 2);
        std::fs::remove_dir_all(out).expect("was written");
    }
}
