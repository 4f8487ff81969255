//! How much of an object's surface an image holds: a single-pole camera beside the pinhole of the same place, size and field.

use camera::{Bounds, Camera, Spoc};
use glam::DVec3;
use gpu::Gpu;
use protocol::Look;
use server::impostors::Faces;
use server::impostors::draw::coverage::{SurfacePoint, covered_share, is_covered, surface_points};
use server::impostors::draw::{ImpostorCapture, ImpostorDrawer, Subject};

use crate::compare::Picture;
use crate::report::{Bar, Report, Row};
use crate::stage::Stage;
use crate::topic::Run;

const SCENE: &str = "teapots";
const OBJECT: &str = "turning teapot";
const SIZE_PX: (u32, u32) = (256, 256);
/// Points that the surface is sampled at, evenly by area.
const POINTS: usize = 100_000;
/// Widths of the ring of eyes, in radii of the object; the server's is 1.
const RINGS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// What a single-pole image must hold, over what the pinhole holds.
const BAR: f64 = 1.3;

/// Measures the teapot of a built-in scene.
pub(super) fn measure(gpu: &Gpu, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, crate::stage::load_scene(SCENE, 1.0)?, Look::Plain)?;
    let eye_world = server::start::start_pose(&stage.scene).translation;
    stage.show(0.0, eye_world)?;
    let object = stage.scene.instances.iter().position(|instance| instance.name == OBJECT);
    let object = anyhow::Context::context(object, "the teapot")? as u16;
    let points = surface_points(&stage.scene, stage.snapshot(), object, POINTS);
    let bounds = Bounds::around(points.iter().map(|point| point.position_world));
    let bounds = anyhow::Context::context(bounds, "the teapot has a surface")?;
    let radius_m = (bounds.max - bounds.min).length() / 2.0;
    let mut drawer = ImpostorDrawer::new(&stage.renderer)?;
    let subject = Subject { objects: &|id| id == object, faces: Faces::Front };
    let mut best = None;
    for ring in RINGS {
        let Some(spoc) = Spoc::around(&bounds, eye_world, SIZE_PX, ring * radius_m) else { continue };
        let mut draw = |camera| drawer.draw(&stage.renderer, &camera, subject);
        let [straight, pushed] = [draw(Camera::Pinhole(spoc.pinhole))?, draw(Camera::Spoc(spoc))?];
        let shares = [covered_share(&points, &straight), covered_share(&points, &pushed)];
        let mut row = Row::new(SCENE, &format!("coverage, ring of {ring} radii"));
        row.counts.set("covered_by_pinhole", shares[0]);
        row.counts.set("covered", shares[1]);
        row.counts.set("covered_over_pinhole", shares[1] / shares[0]);
        report.rows.push(row);
        if best.is_none_or(|best| shares[1] / shares[0] > best) {
            best = Some(shares[1] / shares[0]);
        }
        if ring == 1.0 {
            show(&points, [&straight, &pushed], (&bounds, eye_world), run, report)?;
        }
    }
    // Bars are met by at most a figure: the pinhole's share over ours.
    let what = format!("{SCENE}: surface in the pinhole image over the best single-pole image");
    report.bars.push(Bar::at_most(what, 1.0 / BAR, best.map(|best| 1.0 / best), ""));
    Ok(())
}

const HELD: [u8; 3] = [70, 120, 190];
const MISSING: [u8; 3] = [235, 190, 170];

/// What both images hold, seen from the side, from above and from below (the papers' Fig. 7 and 8).
fn show(
    points: &[SurfacePoint],
    captures: [&ImpostorCapture; 2],
    (bounds, eye_world): (&Bounds, DVec3),
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let middle = bounds.middle();
    let away = (middle - eye_world).normalize();
    let side = away.cross(DVec3::Y).normalize();
    let mut pictures = Vec::new();
    for capture in captures {
        for forward in [away, side, DVec3::NEG_Y + 0.01 * side, DVec3::Y + 0.01 * side] {
            let distance_m = 2.2 * (bounds.max - bounds.min).length();
            let pose = camera::Rigid::look_at(middle - forward.normalize() * distance_m, middle);
            let view = camera::Pinhole::symmetric(pose, (200, 200), 0.5, 0.01);
            pictures.push(painted(points, capture, &view));
        }
    }
    let caption = format!(
        "{SCENE}: the samples of the pot in a pinhole image, then in a single-pole image of the same eye, size and field: from the eye, \
         from the side, from above and from below. Blue: held."
    );
    let path = run.figure(report, format!("{SCENE}-coverage.png"), caption);
    Ok(Picture::beside(&pictures.iter().collect::<Vec<_>>(), 2).write(&path)?)
}

/// The surface's points, nearest last, by whether an image holds them; those that face away are left out.
fn painted(points: &[SurfacePoint], capture: &ImpostorCapture, view: &camera::Pinhole) -> Picture {
    let eye_world = view.world_from_eye.translation;
    let mut picture = Picture::filled(view.width_px, view.height_px, [255; 3]);
    let mut w = vec![0.0; picture.pixel_count()];
    for point in points {
        if point.normal_world.dot(point.position_world - eye_world) > 0.0 {
            continue;
        }
        let Some(image) = view.image_from_world(point.position_world) else { continue };
        if !(image.u >= 0.0 && image.v >= 0.0 && image.u < view.width_px.into() && image.v < view.height_px.into()) {
            continue;
        }
        let at = image.v as usize * view.width_px as usize + image.u as usize;
        if image.w > w[at] {
            w[at] = image.w;
            let colour = if is_covered(point, capture) { HELD } else { MISSING };
            picture.rgb[3 * at..3 * at + 3].copy_from_slice(&colour);
        }
    }
    picture
}
