//! Topic `reconstruction`: how well a client's surfaces stand for the scene, method by method.
//!
//! Seeded eyes in the region that a set of images was made for look at the scene through the client's own library; the
//! plain renderer gives the truth. Methods differ in the images (non-redundant or conventional, of the same views), in where the
//! corners of a sample's quad come from (Xie, Wang, Popescu 2016, Alg. 4, and the averaged corners of `surface`), also with depths as they
//! were before they were quantized, and in what is drawn in place of quads (`baselines`).
//!
//! One more row shows what sampling alone costs: a conventional image from the very eye, as wide and as large as image 0 of the
//! product's set. Nothing is hidden from it, so all of its errors come from drawing samples on another grid of pixels. And one
//! shows what the server makes of the product's set for a viewer who stands still: completed and trimmed, look by look.

mod baselines;
pub(crate) mod cover;
pub(crate) mod eyes;
mod found;
mod method;
mod output;
mod settings;
mod settled;

use anyhow::Context;
use camera::Pinhole;
use clap::Args;
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::{DepthImage, Look};
use rayon::prelude::*;
use server::coding::CodingRule;
use server::discretize::Discretizer;
use surface::mesh::{self, MeshOptions, OffsetImage};
use surface::{HeldSurfaces, PatchMesh};

use crate::client_view::{ClientView, HeldSet};
use crate::compare::score;
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::sets::{self, ImageSet};
use crate::stage::{Stage, picture};
use crate::topic::{Run, Topic, scene_label};
use cover::{HeldImage, shares, verdicts};
use eyes::Eye;
use found::{Found, Shown};
use method::{Method, Rebuilt, Source, methods};
use settings::{Arguments, SEED, Settings};

/// See the module.
pub struct Reconstruction;

impl Topic for Reconstruction {
    fn name(&self) -> &'static str {
        "reconstruction"
    }

    fn about(&self) -> &'static str {
        "How well a client's surfaces stand for the scene: holes, cracks, false cover and leaks, picture errors, time and \
         bytes, for each source of corners, from non-redundant and from conventional images of the same views."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        ["urban", "birdnest", "pillars"].map(str::to_owned).to_vec()
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
    Ok(())
}

fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let loaded = run.load(name)?;
    let mut server = settled::Server::new(gpu, loaded.clone(), &settings.product())?;
    let mut stage = Stage::new(gpu, loaded, Look::Plain).with_context(|| name.to_owned())?;
    let label = stage.scene.name.clone();
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let mut view = ClientView::new(gpu, settings.size_px)?;
    let methods = methods(settings);
    let frames: usize = methods.iter().map(|method| settings.eyes.div_ceil(method.stride)).sum();
    let progress = Progress::new(format!("{label}: choosing eyes"), 2 * frames as u64);
    let eyes = eyes::choose(&mut stage, run.read_trace()?.as_ref(), settings.eyes, settings.size_px, SEED)?;
    for method in methods {
        progress.say(format!("{label}: {}", method.name()));
        let mut shown = Vec::new();
        for (index, eye) in eyes.iter().enumerate().step_by(method.stride) {
            shown.push(match method.source {
                Source::Settled => server.show(&mut view, index, eye)?,
                _ => show(gpu, &mut stage, &mut discretizer, &mut view, (index, eye), &method)?,
            });
            progress.step();
        }
        let found: Vec<(usize, Found)> = shown
            .par_iter()
            .map(|shown| {
                progress.step();
                anyhow::Ok((shown.eye, judge(shown, &eyes[shown.eye])?))
            })
            .collect::<anyhow::Result<_>>()?;
        let row = output::row(&label, &method, &found);
        if method.is_product(settings) {
            bars(&label, &row, report);
            let worst = found.iter().max_by(|a, b| {
                let flip = |found: &Found| found.scores.flip_covered.unwrap_or(0.0);
                flip(&a.1).total_cmp(&flip(&b.1))
            });
            if let Some((eye, _)) = worst {
                let shown = shown.iter().find(|shown| shown.eye == *eye).expect("it was shown");
                output::picture_of(shown, &eyes[*eye], &label, run, report)?;
            }
        }
        report.rows.push(row);
    }
    output::plots(&label, run, report)
}

fn show(
    gpu: &Gpu,
    stage: &mut Stage,
    discretizer: &mut Discretizer,
    view: &mut ClientView,
    (index, eye): (usize, &Eye),
    method: &Method,
) -> anyhow::Result<Shown> {
    stage.show(0.0, eye.middle.translation)?;
    let middle = if method.source == Source::SetFromTheEye { eye.output.world_from_eye } else { eye.middle };
    let (views, precision) = sets::planned(&stage.scene, middle, &eye.output, &method.plan);
    let set = sets::make(stage, discretizer, &views, method.plan.discretization, precision)?;
    let offset = if method.rebuilt.takes_offset_images() {
        let views = sets::offset_views(&views);
        Some(sets::make(stage, discretizer, &views, method.plan.discretization, precision)?)
    } else {
        None
    };
    let look = (stage.renderer.materials(), &stage.lighting);
    let mesh = |surfaces: &HeldSurfaces, held: &HeldPatch, index: usize| {
        let of = Rebuilding { surfaces, held, index, output: &eye.output, set: &set, offset: offset.as_ref() };
        of.mesh(method.rebuilt)
    };
    let held = HeldSet::with_meshes(gpu, &set.images, look, mesh)?;
    let drawn = view.frame(&held, &eye.output, method.rebuilt.options())?;
    let images: Vec<HeldImage> = set.images.iter().map(HeldImage::new).collect();
    Ok(Shown {
        eye: index,
        verdicts: verdicts(&eye.truth, &drawn.w, &eye.output, &images),
        drawn: drawn.picture,
        times_ms: [set.images_ms, held.build_ms, drawn.frame_ms],
        images: [set.images, offset.map_or_else(Vec::new, |offset| offset.images)].concat(),
    })
}

/// A patch that is to be rebuilt.
struct Rebuilding<'a> {
    surfaces: &'a HeldSurfaces,
    held: &'a HeldPatch,
    /// Number of its image in the set.
    index: usize,
    output: &'a Pinhole,
    set: &'a ImageSet,
    offset: Option<&'a ImageSet>,
}

impl Rebuilding<'_> {
    fn mesh(&self, rebuilt: Rebuilt) -> PatchMesh {
        let image = &self.held.patch.image;
        let camera = *image.camera.root();
        let (corners, exact) = match rebuilt {
            Rebuilt::Quads(corners) => (corners, false),
            Rebuilt::ExactQuads(corners) => (corners, true),
            Rebuilt::Mesh => return baselines::grid_mesh(image, &camera, false),
            Rebuilt::MeshWithBorders => return baselines::grid_mesh(image, &camera, true),
            Rebuilt::Points => return baselines::points(image, &camera, self.output),
        };
        let exact_w = |set: &'_ ImageSet| exact.then(|| set.exact_w[self.index].clone());
        let (own_w, offset_w) = (exact_w(self.set), self.offset.and_then(exact_w));
        let offset_image =
            self.offset.map(|offset| OffsetImage { image: &offset.images[self.index], exact_w: offset_w.as_deref() });
        let options = MeshOptions { corners, exact_w: own_w.as_deref(), offset_image, ..self.surfaces.mesh_options() };
        mesh::build(self.held, &options)
    }
}

fn judge(shown: &Shown, eye: &Eye) -> anyhow::Result<Found> {
    Ok(Found {
        shares: shares(&shown.verdicts, &eye.truth).context("an eye that sees nothing")?,
        scores: score(&shown.drawn, &picture(&eye.truth), None)?,
        times_ms: shown.times_ms,
        encoded_bytes: sets::encoded(&shown.images, CodingRule::default().coding(None))
            .iter()
            .map(Vec::len)
            .sum::<usize>() as f64,
        raw_bytes: shown.images.iter().map(DepthImage::raw_bytes).sum::<usize>() as f64,
        samples: shown.images.iter().map(DepthImage::sample_count).sum::<usize>() as f64,
    })
}

/// Mean holes, false cover and FLIP that the product must keep.
fn bars(label: &str, row: &Row, report: &mut Report) {
    let false_cover = if label == "birdnest" { 0.015 } else { 0.008 };
    let bars =
        [("holes_share", 0.003, "share"), ("false_cover_share", false_cover, "share"), ("flip_covered", 0.06, "")];
    for (name, at_most, unit) in bars {
        let found = row.error.get(name).map(|spread| spread.mean);
        let what = format!("{label}: {}, mean", name.trim_end_matches("_share").replace('_', " "));
        report.bars.push(Bar::at_most(what, at_most, found, unit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn a_scene_is_measured_by_every_method() {
        let out = scratch_folder("reconstruction");
        let run = Run::new(vec!["pillars".to_owned()], out.clone());
        let mut report = Report::new("reconstruction", "");
        let settings = Settings { size_px: (96, 64), eyes: 1, image_px: 96, curves: false, only_bars: false };
        measure(&settings, &run, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let figure = |row: &Row, path: &str| row.figure(path).expect(path);
        assert_eq!(report.rows.len(), methods(&settings).len());
        for row in &report.rows {
            // A closed room seen from within the region of its images: little is missing but where a mesh ends before outlines.
            let holes = figure(row, "error.holes_share.mean");
            assert_eq!(holes < 0.03, !row.method.ends_with(" mesh"), "{}: {:?}", row.method, row.error);
            assert!(figure(row, "error.flip_covered.mean") < 0.2, "{}: {:?}", row.method, row.error);
        }
        let samples = |method: &str| {
            let row = report.rows.iter().find(|row| row.method.starts_with(method)).expect(method);
            figure(row, "counts.samples")
        };
        assert!(samples("covered, averaged") < 0.8 * samples("conventional, averaged"));
        assert!(samples("floor") < 0.3 * samples("conventional, averaged"), "one image of four");
        assert_eq!(report.bars.len(), 3, "one set of bars for the product");
        for figure in &report.figures {
            assert!(out.join(&figure.file).exists(), "{}", figure.file);
        }
        std::fs::remove_dir_all(out).expect("was written");
    }
}
