//! Time of a client's frame by the size of output and images and by fine steps, and what the shaders' rays cost.

use camera::Camera;
use client::draw::reflect::{Search, Settings as Drawing};
use gpu::Gpu;
use protocol::Look;
use scene::Scene;

use super::reflect::{Images, Maker, Path, held_view, put_up};
use super::settings::Settings;
use super::sizes::scaled;
use crate::client_view::ClientView;
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;

/// Sides of outputs in pixels; the papers measure from 256 to 1,024.
pub(super) const OUTPUT_PX: [u32; 3] = [256, 512, 1024];
/// Fine steps, as shares of a pixel, by their names in columns.
pub(super) const SEARCHES: [(&str, Search); 3] =
    [("quarter", Search::Quarter), ("half", Search::Half), ("whole", Search::Whole)];
/// Frames that a time is the median of.
const REPEATS: usize = 5;

/// Sides of single-pole images.
pub(super) const IMAGE_PX: [u32; 3] = [128, 256, 512];

/// Measures the first pose of a path: outputs of every size by every step, and single-pole images of every size.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    report: &mut Report,
) -> anyhow::Result<()> {
    outputs(gpu, scene, path, settings, report)?;
    images(gpu, scene, path, settings, report)
}

fn images(gpu: &Gpu, scene: &Scene, path: &Path, settings: &Settings, report: &mut Report) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    let mut maker = Maker::new(&stage)?;
    let output_px = if settings.quick { OUTPUT_PX[0] } else { OUTPUT_PX[1] };
    let Some((time_s, view)) = path.views(scene, (output_px, output_px)).next() else { return Ok(()) };
    stage.show(time_s, view.world_from_eye.translation)?;
    let held = held_view(gpu, &stage, &view)?;
    let mut client = ClientView::new(gpu, (output_px, output_px))?;
    for side_px in IMAGE_PX {
        let by = |camera: &Camera| resized(camera, side_px).unwrap_or_else(|| camera.clone());
        let mut construction_ms = Vec::new();
        for _ in 0..REPEATS {
            construction_ms.push(maker.make_by(&stage, &view, Images::Decided, by)?.draw_ms);
        }
        let made = maker.make_by(&stage, &view, Images::Decided, by)?;
        if !made.images.iter().any(|(wanted, _)| resized(&wanted.camera, side_px).is_some()) {
            return Ok(());
        }
        let impostors = put_up(gpu, &made, None)?;
        let options = client::draw::frame::Options::default();
        let draw = |_| client.draw_reflecting(&held, Some(&impostors), &view, options);
        let times = (0..=REPEATS).map(draw).collect::<anyhow::Result<Vec<f64>>>()?;
        let mut row = Row::new(&scene.name, &format!("frame, single-pole image {side_px}x{side_px}"));
        for (name, values) in [("frame", &times[1..]), ("construction", &construction_ms)] {
            if let Some(spread) = Spread::of(values, Better::Lower) {
                row.time_ms.set(name, spread);
            }
        }
        report.rows.push(row);
    }
    Ok(())
}

fn outputs(gpu: &Gpu, scene: &Scene, path: &Path, settings: &Settings, report: &mut Report) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    let mut maker = Maker::new(&stage)?;
    let sizes = if settings.quick { &OUTPUT_PX[..1] } else { &OUTPUT_PX[..] };
    for &side_px in sizes {
        let Some((time_s, view)) = path.views(scene, (side_px, side_px)).next() else { return Ok(()) };
        stage.show(time_s, view.world_from_eye.translation)?;
        let made = maker.make(&stage, &view, Images::Decided)?;
        let (impostors, held) = (put_up(gpu, &made, None)?, held_view(gpu, &stage, &view)?);
        let mut client = ClientView::new(gpu, (side_px, side_px))?;
        let mut row = Row::new(&scene.name, &format!("frame, output {side_px}x{side_px}"));
        let mut times = |reflect: Option<Drawing>| -> anyhow::Result<Option<Spread>> {
            let options = client::draw::frame::Options { reflect: reflect.unwrap_or_default(), ..Default::default() };
            let impostors = reflect.map(|_| &impostors);
            client.draw_reflecting(&held, impostors, &view, options)?;
            let draw = |_| client.draw_reflecting(&held, impostors, &view, options);
            let times = (0..REPEATS).map(draw).collect::<anyhow::Result<Vec<f64>>>()?;
            Ok(Spread::of(&times, Better::Lower))
        };
        for (name, search) in SEARCHES {
            if let Some(spread) = times(Some(Drawing { search, ..Drawing::default() }))? {
                row.time_ms.set(format!("frame_at_{name}_px"), spread);
            }
        }
        if let Some(spread) = times(None)? {
            row.time_ms.set("frame_without", spread);
        }
        for (name, search) in SEARCHES {
            let reflect = Drawing { search, count_steps: true, ..Drawing::default() };
            let options = client::draw::frame::Options { reflect, ..Default::default() };
            client.draw_reflecting(&held, Some(&impostors), &view, options)?;
            if let Some(sum) = client.steps()? {
                row.counts.set(format!("steps_a_walk_at_{name}_px"), sum.steps / sum.walks.max(1.0));
                row.counts.set("walks_a_pixel", sum.walks / f64::from(side_px * side_px));
            }
        }
        report.rows.push(row);
    }
    Ok(())
}

/// Whether a camera's image is made in another size here, and the camera for it.
fn resized(camera: &Camera, side_px: u32) -> Option<Camera> {
    let Camera::Spoc(spoc) = camera else { return None };
    Some(scaled(camera, f64::from(side_px) / f64::from(spoc.pinhole.width_px)))
}
