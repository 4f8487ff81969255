//! Steps of a ray by every way of walking, with the rays that a reflector sends out: on the CPU, where each is counted.

use camera::{Camera, Pinhole};
use gpu::Gpu;
use impostor::{Impostor, Method, Ray, Steps};
use protocol::Look;
use rayon::prelude::*;
use scene::Scene;

use super::reflect::{Images, Maker, Path};
use super::settings::Settings;
use crate::raytrace::{Effects, RayTruth, reflectors};
use crate::report::{Report, Row};
use crate::stage::Stage;

/// Of the fine steps, in pixels.
pub(super) const FINE_PX: [f64; 3] = [0.25, 0.5, 1.0];
/// The papers measure with 6.
const COARSE_PX: [f64; 4] = [3.0, 6.0, 9.0, 12.0];
/// Rays that are followed, spread over the reflector.
const RAYS: usize = 4000;

/// The name of a way to walk.
fn name(method: Method) -> String {
    match method {
        Method::Points => "points".to_owned(),
        Method::Fine => "fine".to_owned(),
        Method::Coarse { coarse_px } => format!("coarse {coarse_px}"),
        Method::Hierarchy => "hierarchy".to_owned(),
    }
}

/// Counts for the first pose of a path.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    report: &mut Report,
) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    let Some((time_s, view)) = path.views(scene, settings.size_px).next() else { return Ok(()) };
    stage.show(time_s, view.world_from_eye.translation)?;
    let rays = reflected(scene, &stage, &view);
    let made = Maker::new(&stage)?.make(&stage, &view, Images::Decided)?;
    let kinds = [("single pole", is_spoc as fn(&Camera) -> bool), ("graph", is_graph)];
    for (kind, is_kind) in kinds {
        let Some((_, image)) = made.images.iter().find(|(wanted, _)| is_kind(&wanted.camera)) else { continue };
        let impostor = Impostor::new(image.camera.clone(), &image.samples)?;
        let methods = [Method::Points, Method::Fine, Method::Hierarchy];
        let coarse = COARSE_PX.map(|coarse_px| Method::Coarse { coarse_px });
        for method in methods.into_iter().chain(coarse) {
            let mut row = Row::new(&scene.name, &format!("steps, {kind}, {}", name(method)));
            for fine_px in FINE_PX {
                let steps = Steps { method, fine_px };
                let counts: Vec<u32> = rays.par_iter().map(|ray| impostor.hit(ray, steps).count.steps()).collect();
                let walked: Vec<u32> = counts.into_iter().filter(|count| *count > 0).collect();
                let mean = walked.iter().map(|&count| f64::from(count)).sum::<f64>() / walked.len().max(1) as f64;
                row.counts.set(format!("steps_at_{fine_px}_px"), mean);
            }
            report.rows.push(row);
        }
    }
    Ok(())
}

fn is_spoc(camera: &Camera) -> bool {
    matches!(camera, Camera::Spoc(_))
}

fn is_graph(camera: &Camera) -> bool {
    matches!(camera, Camera::Graph(_))
}

/// The mirrored rays of a view's reflectors, at most [`RAYS`].
fn reflected(scene: &Scene, stage: &Stage, view: &Pinhole) -> Vec<Ray> {
    let traced = RayTruth::new(scene, stage.snapshot(), &stage.lighting).picture(view, &Effects::PLAIN, 1);
    let on_reflector = traced.mask(&reflectors(scene));
    let eye_world = view.world_from_eye.translation;
    let first = traced.first.iter().zip(&on_reflector).filter(|(_, on)| **on);
    let rays: Vec<Ray> = first
        .filter_map(|(point, _)| {
            let point = point.as_ref()?;
            let incoming = (point.p_world - eye_world).normalize();
            let outgoing = incoming - 2.0 * incoming.dot(point.normal_world) * point.normal_world;
            Some(Ray::endless(point.p_world, outgoing))
        })
        .collect();
    let every = rays.len().div_ceil(RAYS).max(1);
    rays.into_iter().step_by(every).collect()
}
