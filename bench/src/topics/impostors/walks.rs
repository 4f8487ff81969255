//! The ways in which a client's rays walk, by fine steps and by the size of images: error over all that reflects, steps, and time of a frame.

use camera::Camera;
use client::draw::frame::Options;
use client::draw::reflect::{EdgeRays, Search, Settings as Drawing, Walk};
use gpu::Gpu;
use protocol::Look;
use scene::Scene;

use super::reflect::{Images, Maker, Path, TRUTH_RAYS_A_SIDE, held_view, put_up};
use super::settings::Settings;
use super::sizes::scaled;
use super::times::SEARCHES;
use crate::client_view::ClientView;
use crate::raytrace::{Effects, RayTruth, masked_errors, reflectors};
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;

/// Columns of images.
pub(super) const IMAGE_PX: [u32; 3] = [256, 512, 1024];
/// Frames of a pose that times are of.
const REPEATS: usize = 3;
/// Ticks of a second in which Linux counts a process's time.
const TICKS_HZ: f64 = 100.0;
/// Steps of 8-bit colours by which a pixel may be off without counting as another one: what rounding leaves.
const ROUNDING: u8 = 2;

/// A way to draw reflections.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub name: &'static str,
    walk: Walk,
    edges: bool,
    /// Whether it is measured by every fine step, or by those of a pixel alone.
    by_every_step: bool,
}

const fn way(name: &'static str, walk: Walk) -> Way {
    Way { name, walk, edges: false, by_every_step: true }
}

const fn by_whole_steps(name: &'static str, walk: Walk, edges: bool) -> Way {
    Way { name, walk, edges, by_every_step: false }
}

/// What others are compared with.
pub(super) const HIERARCHY: &str = "hierarchy";

pub(super) const WAYS: [Way; 9] = [
    way(HIERARCHY, Walk::Hierarchy),
    way("two passes", Walk::TwoPass),
    way("fine", Walk::Fine),
    way("coarse 6", Walk::Coarse { coarse_px: 6 }),
    by_whole_steps("coarse 3", Walk::Coarse { coarse_px: 3 }, false),
    by_whole_steps("coarse 9", Walk::Coarse { coarse_px: 9 }, false),
    by_whole_steps("coarse 12", Walk::Coarse { coarse_px: 12 }, false),
    by_whole_steps("hierarchy, five rays at edges", Walk::Hierarchy, true),
    by_whole_steps("two passes, five rays at edges", Walk::TwoPass, true),
];

/// What a way cost over all poses.
#[derive(Default)]
struct Found {
    errors: Vec<f64>,
    frame_ms: Vec<f64>,
    cpu_ms: Vec<f64>,
    steps: f64,
    walks: f64,
    /// Pixels that reflect, and those of them that show something else than by the hierarchy with the same steps.
    pixels: f64,
    differ: f64,
}

/// The name of a row.
pub(super) fn label(way: &str, step: &str, side_px: u32) -> String {
    format!("walk, {way}, steps of a {step} pixel, images {side_px} wide")
}

/// Measures every way along a path.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    report: &mut Report,
) -> anyhow::Result<()> {
    // For all sizes, as pipelines take long to be made.
    let mut client = ClientView::new(gpu, settings.size_px)?;
    let sizes = if settings.quick { &IMAGE_PX[..1] } else { &IMAGE_PX[..] };
    for &side_px in sizes {
        let all = SEARCHES.iter().flat_map(|step| WAYS.map(|way| (*step, way, Found::default())));
        let mut rows: Vec<_> = all.filter(|((_, step), way, _)| way.by_every_step || *step == Search::Whole).collect();
        of_size(gpu, &mut client, (scene, path), settings, side_px, &mut rows)?;
        for ((step, _), way, found) in rows {
            let mut row = Row::new(&scene.name, &label(way.name, step, side_px));
            if let Some(spread) = Spread::of(&found.errors, Better::Lower) {
                row.error.set("rgb_reflecting", spread);
            }
            for (name, times) in [("frame", &found.frame_ms), ("frame_cpu", &found.cpu_ms)] {
                if let Some(spread) = Spread::of(times, Better::Lower) {
                    row.time_ms.set(name, spread);
                }
            }
            row.counts.set("steps_a_pixel", found.steps / found.pixels.max(1.0));
            row.counts.set("walks_a_pixel", found.walks / found.pixels.max(1.0));
            row.counts.set("differ", found.differ / found.pixels.max(1.0));
            report.rows.push(row);
        }
    }
    Ok(())
}

/// The time that all threads of this process have run; Linux alone says. What a frame costs on a software renderer, whatever else a
/// machine does.
fn cpu_ms() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Behind the name in parentheses the 12th and the 13th: by the process, and by the system for it.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: f64 = fields.get(11..13)?.iter().filter_map(|ticks| ticks.parse::<f64>().ok()).sum();
    Some(ticks / TICKS_HZ * 1e3)
}

fn of_size(
    gpu: &Gpu,
    client: &mut ClientView,
    (scene, path): (&Scene, &Path),
    settings: &Settings,
    side_px: u32,
    rows: &mut [((&str, Search), Way, Found)],
) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    let mut maker = Maker::new(&stage)?;
    let reflecting = reflectors(scene);
    for (time_s, view) in path.views(scene, settings.size_px) {
        stage.show(time_s, view.world_from_eye.translation)?;
        let effects = Effects { max_bounces: 2, ..Effects::ONE_BOUNCE };
        let tracer = RayTruth::new(scene, stage.snapshot(), &stage.lighting);
        let traced = tracer.picture(&view, &effects, if settings.one_ray { 1 } else { TRUTH_RAYS_A_SIDE });
        let mask = traced.mask(&reflecting);
        let wide = |camera: &Camera| scaled(camera, f64::from(side_px) / f64::from(camera.size_px().0));
        let made = maker.make_by(&stage, &view, Images::Decided, wide)?;
        let (impostors, held) = (put_up(gpu, &made, None)?, held_view(gpu, &stage, &view)?);
        let mut by_hierarchy: Vec<[u8; 3]> = Vec::new();
        for ((_, search), way, found) in rows.iter_mut() {
            let drawing = Drawing {
                search: *search,
                walk: way.walk,
                filter: !settings.one_ray,
                edges: if way.edges { EdgeRays::Always } else { EdgeRays::Never },
                ..Drawing::default()
            };
            let counting = Options { reflect: Drawing { count_steps: true, ..drawing }, ..Options::default() };
            client.draw_reflecting(&held, Some(&impostors), &view, counting)?;
            let counted = client.steps()?.unwrap_or_default();
            found.steps += counted.steps;
            found.walks += counted.walks;
            let options = Options { fill: false, reflect: drawing, ..Options::default() };
            let drawn = client.frame_reflecting(&held, Some(&impostors), &view, options)?;
            let began_ms = cpu_ms();
            for _ in 0..REPEATS {
                found.frame_ms.push(client.draw_reflecting(&held, Some(&impostors), &view, options)?);
            }
            found.cpu_ms.extend(began_ms.zip(cpu_ms()).map(|(began, ended)| (ended - began) / REPEATS as f64));
            let shown: Vec<[u8; 3]> = drawn.picture.rgb.as_chunks().0.to_vec();
            found.errors.extend(masked_errors(&traced.rgb, &shown, &mask, &mask)?.map(|spread| spread.mean));
            if way.name == HIERARCHY {
                by_hierarchy.clone_from(&shown);
            }
            let is_other = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > ROUNDING);
            let differ =
                shown.iter().zip(&by_hierarchy).map(is_other).zip(&mask).filter(|(differ, on)| *differ && **on);
            found.differ += differ.count() as f64;
            found.pixels += mask.iter().filter(|on| **on).count() as f64;
        }
    }
    Ok(())
}
