//! Topic `shadows`: soft shadows of an area light, drawn by a client from images of the light's own, against two truths.
//!
//! Xie, Wang, Popescu 2016, section 6.2: a square lamp over the scene is sampled from its corners (depth peeling: from its middle), a client
//! rebuilds surfaces, and tells for each pixel which of the lamp's points it sees. The truths are shadow maps of the full geometry from the
//! same points, which the paper's errors are against, and rays. Pixels are those of the full geometry, for a client that holds
//! an image of the very view: shadows alone differ.

mod hidden;
mod lamp;
mod output;
mod sets;

use camera::Pinhole;
use clap::Args;
use client::soft::{Lamp, Method, Settings as Drawing};
use gpu::Gpu;
use protocol::Look;
use server::discretize::{Capture, DepthPrecision, Discretization, Discretizer};

use crate::raytrace::RayTruth;
use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::spread::Spread;
use crate::stage::Stage;
use crate::topic::{Run, Topic, scene_label};
use hidden::{Errors, Hidden, MapTruth, receivers};
use sets::{Client, SETS};

/// See the module.
pub struct Shadows;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Sides of the lamp's images in pixels [default: 512, 1024 and 1536, with --quick 256].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..=4096))]
    image_size: Vec<u32>,
    /// Diagonals of the lamp, in those of the scene's box [default: 1, and 1/4, 1/2, 2 and 4 for images of 1024].
    #[arg(long, value_name = "SIZE")]
    lamp: Vec<f64>,
    /// The lamp is N x N points [default: 16, with --quick 4].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32))]
    points: Option<u32>,
    /// Only these sets of images: conventional, non-redundant, depth-peeling or any other method by its name.
    #[arg(long, value_name = "NAME")]
    set: Vec<String>,
}

/// What a run of the topic measures.
#[derive(Debug, Clone)]
struct Settings {
    size_px: (u32, u32),
    points: u32,
    /// Pairs of lamp and images.
    cells: Vec<(f64, u32)>,
    sets: Vec<(String, Discretization)>,
    /// Side of the truth's shadow maps.
    truth_px: u32,
}

/// The paper's sizes of images, of lamps, and what is kept while the other changes.
const IMAGES_PX: [u32; 3] = [512, 1024, 1536];
const LAMPS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
const USUAL_PX: u32 = 1024;

impl Settings {
    fn of(run: &Run, arguments: &Arguments) -> anyhow::Result<Settings> {
        let Arguments { image_size, lamp, points, set } = arguments;
        let cells = if run.quick || !image_size.is_empty() || !lamp.is_empty() {
            let images: &[u32] =
                if image_size.is_empty() { &[if run.quick { 256 } else { USUAL_PX }] } else { image_size };
            let lamps: &[f64] = if lamp.is_empty() { &[1.0] } else { lamp };
            lamps.iter().flat_map(|&lamp| images.iter().map(move |&image_px| (lamp, image_px))).collect()
        } else {
            let by_image = IMAGES_PX.map(|image_px| (1.0, image_px));
            let by_lamp = LAMPS.into_iter().filter(|lamp| *lamp != 1.0).map(|lamp| (lamp, USUAL_PX));
            by_image.into_iter().chain(by_lamp).collect()
        };
        let names: Vec<String> = if set.is_empty() { SETS.map(str::to_owned).to_vec() } else { set.clone() };
        let named = |name: &String| name.parse().map(|method| (name.clone(), method)).map_err(anyhow::Error::msg);
        Ok(Settings {
            size_px: run.size_px.unwrap_or(if run.quick { (256, 256) } else { (512, 512) }),
            points: points.unwrap_or(if run.quick { 4 } else { 16 }),
            cells,
            sets: names.iter().map(named).collect::<anyhow::Result<_>>()?,
            truth_px: if run.quick { 512 } else { 1024 },
        })
    }
}

impl Topic for Shadows {
    fn name(&self) -> &'static str {
        "shadows"
    }

    fn about(&self) -> &'static str {
        "Soft shadows of an area light, drawn by a client from images of the light's corners: errors against shadow maps of the full \
         geometry and against rays, time of each step, by set of images, their size and the light's."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        ["birdnest", "grass", "urban", "tree"].map(str::to_owned).to_vec()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let settings = Settings::of(run, &run.arguments()?)?;
        let gpu = run.gpu(report)?.clone();
        output::describe(report, &settings);
        for name in &run.scenes {
            if let Err(error) = scene(&gpu, name, &settings, run, report) {
                report.rows.push(Row::failed(&scene_label(name), "all", &error));
            }
        }
        output::add(report);
        Ok(())
    }
}

/// Both truths of a lamp.
struct Truths {
    maps: Hidden,
    rays: Hidden,
}

fn scene(gpu: &Gpu, name: &str, settings: &Settings, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, run.load(name)?, Look::Default)?;
    stage.show(0.0, stage.scene.bounds.centre())?;
    let label = stage.scene.name.clone();
    let view = lamp::output(&stage.scene, settings.size_px);
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let shown = discretizer.run(&stage.renderer, &[view], Discretization::Conventional)?.wait()?.remove(0);
    let client = Client::new(gpu, &stage, &shown.depth_image(DepthPrecision::Finest), &view)?;
    let progress = Progress::new(format!("{label}: shadows"), (settings.cells.len() * settings.sets.len()) as u64);
    let mut last: Option<(f64, Truths)> = None;
    for &(size, image_px) in &settings.cells {
        let lamp = lamp::over(&stage.scene, size);
        if last.as_ref().is_none_or(|(last, _)| *last != size) {
            progress.say(format!("{label}: truths of a lamp of {size}"));
            last = Some((size, truths(&stage, &mut discretizer, &lamp, (&shown, &view), settings)?));
        }
        let Some((_, truths)) = &last else { continue };
        for (set, method) in &settings.sets {
            progress.say(format!("{label}: {set}, images of {image_px}, a lamp of {size}"));
            let made =
                cell(&stage, &mut discretizer, (set, *method), (&lamp, size, image_px), &client, (settings, truths));
            for (row, hidden) in made.unwrap_or_else(|error| {
                report.rows.push(Row::failed(&label, set, &error));
                Vec::new()
            }) {
                output::picture(&row, &hidden, settings.size_px, run, report)?;
                report.rows.push(row);
            }
            progress.step();
        }
        output::picture(&Row::new(&label, "truth by rays"), &truths.rays, settings.size_px, run, report)?;
        output::picture(&Row::new(&label, "truth by maps"), &truths.maps, settings.size_px, run, report)?;
    }
    Ok(())
}

/// Ways of drawing by their names, the paper's first. Sets other than the paper's own are drawn by that alone.
const METHODS: [(&str, Method); 2] = [("maps", Method::Maps), ("warp", Method::Warp)];

/// One set of images, and what a client makes of it by every method.
fn cell(
    stage: &Stage,
    discretizer: &mut Discretizer,
    (set, method): (&str, Discretization),
    (lamp, size, image_px): (&Lamp, f64, u32),
    client: &Client,
    (settings, truths): (&Settings, &Truths),
) -> anyhow::Result<Vec<(Row, Hidden)>> {
    let made = sets::make(stage, discretizer, method, lamp, image_px)?;
    let casters = client.casters(&made.images)?;
    let samples = made.images.iter().map(|image| image.sample_count()).sum::<usize>();
    let is_all = method == Discretization::PIXEL;
    let row = |(name, method): (&str, Method)| {
        let drawing = Drawing { method, points: settings.points, map_px: image_px };
        let shadows_ms = client.shadows(lamp, &casters, drawing)?;
        let hidden = client.hidden(lamp, &casters, drawing)?;
        let label = if method == Method::Maps { set.to_owned() } else { format!("{set}, {name}") };
        let mut row = Row::new(&stage.scene.name, &label);
        row.parameters.set("image_px", image_px);
        row.parameters.set("lamp", size);
        row.parameters.set("method", name);
        for (name, truth) in [("", &truths.maps), ("_rays", &truths.rays)] {
            let Some(errors) = hidden.errors(truth) else { continue };
            let Errors { visibility, intensity, worst_intensity, pixels } = errors;
            row.error.set(format!("intensity{name}"), Spread { worst: worst_intensity, ..Spread::single(intensity) });
            row.error.set(format!("visibility{name}"), Spread::single(visibility));
            row.counts.set(format!("pixels{name}"), pixels as f64);
        }
        row.counts.set("samples", samples as f64);
        let steps = [("images", made.images_ms), ("surfaces", casters.build_ms), ("shadows", shadows_ms)];
        for (name, ms) in steps {
            row.time_ms.set(name, Spread::single(ms));
        }
        row.time_ms.set("all", Spread::single(steps.iter().map(|(_, ms)| ms).sum()));
        anyhow::Ok((row, hidden))
    };
    METHODS.into_iter().take(if is_all { METHODS.len() } else { 1 }).map(row).collect()
}

fn truths(
    stage: &Stage,
    discretizer: &mut Discretizer,
    lamp: &Lamp,
    (shown, view): (&Capture, &Pinhole),
    settings: &Settings,
) -> anyhow::Result<Truths> {
    let double_sided: Vec<bool> = stage.renderer.materials().iter().map(|material| material.double_sided).collect();
    let points = lamp::point_views(lamp, &stage.scene, settings.points, settings.truth_px)?;
    let mut maps = MapTruth::new(receivers(shown, &double_sided), points.len());
    for (index, point) in points.iter().enumerate() {
        let seen = discretizer.run(&stage.renderer, &[*point], Discretization::Conventional)?.wait()?;
        maps.add(index, &seen[0]);
    }
    let eyes: Vec<_> = points.iter().map(|point| point.world_from_eye.translation).collect();
    let rays = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting).hidden_points(view, &eyes);
    Ok(Truths { maps: maps.done(), rays: Hidden { points: points.len(), pixels: rays } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn sets_of_the_corners_cast_nearly_the_true_shadows() {
        let out = scratch_folder("shadows");
        let run = Run::new(vec!["birdnest".to_owned()], out.clone());
        let mut report = Report::new("shadows", "");
        let arguments = Arguments { image_size: vec![128], points: Some(2), ..Arguments::default() };
        let settings = Settings { size_px: (64, 64), truth_px: 256, ..Settings::of(&run, &arguments).expect("valid") };
        let gpu = run.gpu(&mut report).expect("a GPU adapter, software or not").clone();
        scene(&gpu, "birdnest", &settings, &run, &mut report).expect("measured");
        assert!(!report.has_failures(), "{:?}", report.rows);
        for row in report.rows.iter().filter(|row| SETS.contains(&row.method.as_str())) {
            let figure = |path: &str| row.figure(path).expect(path);
            assert!(figure("error.intensity.mean") <= figure("error.visibility.mean"));
            assert!(figure("error.visibility.mean") < 40.0, "{}: {}", row.method, figure("error.visibility.mean"));
            assert!(figure("error.visibility_rays.mean") < 40.0);
        }
        std::fs::remove_dir_all(out).expect("was written");
    }
}
