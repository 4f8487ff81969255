//! The full look beside rays: what filtering the sky beforehand, fits of integrals and a table of materials cost.

use std::path::Path;

use camera::Pinhole;
use gpu::Gpu;
use scene::environment::Environment;
use server::discretize::Discretizer;

use super::held::held_at;
use crate::client_view::ClientView;
use crate::compare::flip::error_picture;
use crate::compare::{Picture, flip_map, score};
use crate::raytrace::{Effects, RayTruth};
use crate::report::{Figure, Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::{Stage, picture};
use crate::topics::reconstruction::eyes::{Eye, FOV_Y_RAD};

/// Eyes that rays are sent from, and their largest pictures.
const EYES: usize = 2;
pub(super) const SIZE_PX: (u32, u32) = (256, 256);
/// Rays along a pixel's side.
const RAYS: u32 = 3;
const GAP_PX: u32 = 4;

/// A row of the plain renderer and one of a client, both beside rays, and a sheet of the first eye.
pub(super) fn rows(
    gpu: &Gpu,
    (stage, discretizer): (&mut Stage, &mut Discretizer),
    (eyes, size_px): (&[Eye], (u32, u32)),
    out: &Path,
    report: &mut Report,
) -> anyhow::Result<Vec<Row>> {
    let label = stage.scene.name.clone();
    let rays = RayTruth::under(&stage.scene, &stage.scene.at(0.0), &stage.lighting, &Environment::studio());
    let mut view = ClientView::new(gpu, size_px)?;
    let mut found: [Vec<f64>; 2] = Default::default();
    for (index, eye) in eyes.iter().take(EYES).enumerate() {
        let camera = Pinhole::symmetric(eye.output.world_from_eye, size_px, FOV_Y_RAD, eye.output.near_m);
        let truth = rays.picture(&camera, &Effects::PLAIN, RAYS).picture();
        let (_, held) = held_at(gpu, stage, discretizer, eye)?;
        let pictures =
            [picture(&stage.smooth_truth(&camera)?), view.frame(&held, &camera, Default::default())?.picture];
        for (errors, picture) in found.iter_mut().zip(&pictures) {
            errors.push(score(picture, &truth, None)?.flip_covered.unwrap_or(f64::NAN));
        }
        if index == 0 {
            let [drawn, client] = &pictures;
            let error = error_picture(&flip_map(drawn, &truth)?, size_px.0, size_px.1);
            let file = format!("{label}-rays.png");
            Picture::beside(&[&truth, drawn, client, &error], GAP_PX).write(&out.join(&file))?;
            let caption = format!("{label}: rays, the plain renderer, a client, FLIP of the plain renderer.");
            report.figures.push(Figure { file, caption });
        }
    }
    let row = |(method, errors): (&str, &Vec<f64>)| {
        let mut row = Row::new(&label, method);
        if let Some(spread) = Spread::of(errors, Better::Lower) {
            row.error.set("flip_covered", spread);
        }
        row
    };
    Ok(["plain renderer beside rays", "client beside rays"].into_iter().zip(&found).map(row).collect())
}
