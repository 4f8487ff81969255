//! Topic `sampling`: what images of a scene hold of it, discretization by discretization.
//!
//! Reference images are taken at the corners of a triangle of viewpoints (depth peeling: from its middle), and judged by the four
//! metrics of Xie, Wang, Popescu 2016, §6.1.2: how many samples earlier images held already, how many conventional images do not
//! hold, how many of those are of use from between the corners, and how much of output frames from there is held at all. Then the
//! methods beside them, ours too, at the paper's corners and at places of our own choice ([`server::discretize::placement`]) for as
//! many samples, and what images are left out where they would add nothing.

mod convergence;
mod made;
mod metrics;
mod output;
mod paper;
mod peeled;
mod pictures;
mod placed;
mod settings;
mod tables;
mod triangle;

use anyhow::Context;
use camera::Pinhole;
use clap::Args;
use client::draw::frame::Options;
use gpu::Gpu;
use protocol::Look;
use server::coding::CodingRule;
use server::discretize::{Capture, DepthPrecision, Discretization, Discretizer, RedundancyTest};

use crate::client_view::{ClientView, HeldSet};
use crate::compare::score;
use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::sets;
use crate::stage::{Stage, picture};
use crate::topic::{Run, Topic, scene_label};
use crate::topics::reconstruction::cover::{HeldImage, shares, verdicts};
use made::{Made, make, sample_count};
use metrics::{Bench, on_gpu};
use settings::{Arguments, IMAGES, SEED, Settings};
use triangle::ViewTriangle;

/// See the module.
pub struct Sampling;

/// Every so many frames is drawn by a client, too.
const DRAWN_STRIDE: usize = 8;

impl Topic for Sampling {
    fn name(&self) -> &'static str {
        "sampling"
    }

    fn about(&self) -> &'static str {
        "What images of a scene hold of it: redundant, disoccluded, useful and available samples for conventional images, depth \
         peeling and non-redundant images by every test, beside the figures of the 2016 paper; time, bytes and error of each."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        ["birdnest", "grass", "urban", "tree", "mural"].map(str::to_owned).to_vec()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        measure(&Settings::of(run, &run.arguments()?), run, report)
    }
}

fn measure(settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let gpu = run.gpu(report)?.clone();
    output::describe(report, settings);
    for name in &run.scenes {
        if let Err(error) = scene(&gpu, name, settings, run, report) {
            report.rows.push(Row::failed(&scene_label(name), "all", &error));
        }
    }
    tables::add(report);
    output::bars(report);
    Ok(())
}

fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, run.load(name)?, Look::Plain).with_context(|| name.to_owned())?.with_rays();
    let middle = run.read_trace()?.map(|trace| trace.at(0.0));
    let triangle = ViewTriangle::of(&stage.scene, middle, settings.side_m);
    let near_m = server::start::near_m(&stage.scene);
    stage.show(0.0, triangle.middle((8, 8), near_m).world_from_eye.translation)?;
    let (stage, label) = (&stage, stage.scene.name.clone());
    let sizes = settings.convergence_px.len() as u64;
    let progress = Progress::new(format!("{label}: images"), settings.frames as u64 + sizes);
    let mut bench = Bench {
        stage,
        discretizer: Discretizer::new(&stage.renderer)?,
        holds: on_gpu(gpu, stage, RedundancyTest::Pixel)?,
        holds_surface: on_gpu(gpu, stage, RedundancyTest::Surface)?,
    };
    let image_px = (settings.image_px, settings.image_px);
    let corners = triangle.corners(image_px, near_m);
    let mut made = Vec::new();
    for (name, method) in Discretization::NAMED.into_iter().filter(|(name, _)| settings.wants(name)) {
        progress.say(format!("{label}: {name}"));
        let cameras = if method == Discretization::DepthPeeling {
            vec![triangle.middle(image_px, near_m); IMAGES]
        } else {
            corners.clone()
        };
        made.push(make(gpu, &mut bench, name.to_owned(), method, &cameras)?);
    }
    if settings.wants(peeled::NAME) {
        progress.say(format!("{label}: {}", peeled::NAME));
        let cameras = peeled::cameras(&corners);
        made.push(make(gpu, &mut bench, peeled::NAME.to_owned(), peeled::METHOD, &cameras)?);
    }
    if settings.wants(placed::NAME) {
        progress.say(format!("{label}: views of our choice"));
        let paper = made.iter().find(|set| set.method == Discretization::PIXEL);
        let budget = paper.map_or(0, |set| sample_count(&set.captures));
        made.push(placed::make_set(gpu, &mut bench, (&triangle, near_m), settings.image_px, budget)?);
    }
    if settings.wants(placed::ENOUGH) {
        made.push(placed::make_enough(gpu, &mut bench, (&triangle, near_m), settings.image_px, IMAGES)?);
    }
    progress.say(format!("{label}: output frames"));
    let frames = triangle.between(settings.frames, SEED, settings.size_px, near_m);
    let conventional = made[0].captures.clone();
    // The conventional image of the same camera, where there is one; else all of them.
    let references = |capture: &Capture| match conventional.iter().find(|image| image.camera == capture.camera) {
        Some(image) => vec![image.clone()],
        None => conventional.clone(),
    };
    let sets: Vec<_> =
        made.iter().map(|set| (set.captures.as_slice(), set.captures.iter().map(references).collect())).collect();
    let worths = bench.worth(&sets, &frames, |frames| (0..frames).for_each(|_| progress.step()))?;
    let conventional_ms = made[0].set_ms - made[0].first_ms;
    for (set, worth) in made.iter().zip(&worths) {
        progress.say(format!("{label}: a client's picture, {}", set.name));
        let mut row = output::row(&label, set, worth);
        // Views of our own choice are others, and not as many; layers are more.
        if ![placed::NAME, placed::ENOUGH, peeled::NAME].contains(&set.name.as_str()) {
            row.counts.set("later_images_ms_over_conventional", (set.set_ms - set.first_ms) / conventional_ms);
        }
        row.parameters.set("triangle_side_m", triangle.side_m);
        draw(gpu, stage, set, &frames, &mut row)?;
        report.rows.push(row);
    }
    let shown: Vec<_> = made.iter().zip(&worths).collect();
    pictures::worth(&label, &shown, run, report)?;
    pictures::missing(&label, &mut bench, &shown, &frames, (run, report))?;
    for &size_px in &settings.convergence_px {
        progress.say(format!("{label}: metrics at {size_px} x {size_px}"));
        report.rows.extend(convergence::rows(gpu, &mut bench, &triangle, near_m, size_px)?);
        progress.step();
    }
    output::plots(&label, run, report)
}

/// What a client shows of a set, and what the set takes on the wire.
fn draw(gpu: &Gpu, stage: &Stage, set: &Made, frames: &[Pinhole], row: &mut Row) -> anyhow::Result<()> {
    let images: Vec<_> = set.captures.iter().map(|capture| capture.depth_image(DepthPrecision::Finest)).collect();
    let encoded = sets::encoded(&images, CodingRule::default().coding(None));
    row.bytes.set("encoded_set", encoded.iter().map(Vec::len).sum::<usize>() as f64);
    let held_images: Vec<HeldImage> = images.iter().map(HeldImage::new).collect();
    let look = (stage.renderer.materials(), &stage.lighting);
    let held = HeldSet::new(gpu, &images, look)?;
    let size_px = (frames[0].width_px, frames[0].height_px);
    let mut view = ClientView::new(gpu, size_px)?;
    let (mut holes, mut false_cover, mut flip) = (Vec::new(), Vec::new(), Vec::new());
    for frame in frames.iter().step_by(DRAWN_STRIDE.min(frames.len())) {
        let truth = stage.truth(frame)?;
        let drawn = view.frame(&held, frame, Options::default())?;
        let Some(shares) = shares(&verdicts(&truth, &drawn.w, frame, &held_images), &truth) else { continue };
        holes.push(shares.holes);
        false_cover.push(shares.false_cover);
        flip.extend(score(&drawn.picture, &picture(&truth), None)?.flip_covered);
    }
    output::errors(row, &[("holes_share", &holes), ("false_cover_share", &false_cover), ("flip_covered", &flip)]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn every_method_is_measured() {
        let out = scratch_folder("sampling");
        let run = Run::new(vec!["pillars".to_owned()], out.clone());
        let mut report = Report::new("sampling", "");
        let settings = Settings {
            size_px: (48, 48),
            image_px: 96,
            frames: 3,
            side_m: None,
            methods: vec!["all".to_owned()],
            convergence_px: vec![64],
        };
        measure(&settings, &run, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let row = |method: &str| report.rows.iter().find(|row| row.method == method).expect(method);
        let figure = |method: &str, path: &str| row(method).figure(path).expect(path);
        assert_eq!(figure("non-redundant", "counts.redundant_2"), 0.0, "by its own test");
        assert!(figure("conventional", "counts.redundant_2") > 0.5, "most of what the third image sees was seen");
        let missing = |method: &str| figure(method, "error.missing_share.mean");
        assert!(missing("non-redundant") < missing("depth-peeling"), "one eye sees less than three");
        assert!(missing(peeled::NAME) < missing("non-redundant"), "the first three are the same");
        let samples = |method: &str| figure(method, "counts.samples");
        assert!(samples("non-redundant") < 0.9 * samples("conventional"));
        assert!(samples("footprint, placed") <= 1.1 * samples("non-redundant"), "as many samples");
        for figure in &report.figures {
            assert!(out.join(&figure.file).exists(), "{}", figure.file);
        }
        std::fs::remove_dir_all(out).expect("was written");
    }
}
