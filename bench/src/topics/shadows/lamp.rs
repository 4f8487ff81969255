//! The lamp over a scene, and what is seen of the scene by its light.

use camera::{Bounds, Pinhole, Rigid, parallel_views};
use client::draw::soft::Lamp;
use glam::DVec3;
use protocol::{Area, AreaShape};
use scene::Scene;

/// How far above the top of a scene the lamp hangs, as a share of the diagonal of the scene's box.
const HEIGHT: f64 = 0.5;
/// Vertical field of the output.
const FIELD_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// A square lamp that hangs over the middle of a scene and faces down, whose diagonal is `size` times that of the scene's box: the 2016
/// paper, section 6.2, prints this size, not the place.
pub(super) fn over(scene: &Scene, size: f64) -> Lamp {
    let diagonal_m = scene.bounds.min.distance(scene.bounds.max);
    let half_m = size * diagonal_m / 2.0 / std::f64::consts::SQRT_2;
    let top = scene.bounds.centre().with_y(scene.bounds.max.y);
    let half_world = [[half_m, 0.0, 0.0], [0.0, 0.0, half_m]];
    Lamp {
        middle_world: top + DVec3::Y * (HEIGHT * diagonal_m),
        area: Area { half_world, shape: AreaShape::Rectangle },
    }
}

/// The four corners' views of a scene; only of a lamp for which one face is enough.
pub(super) fn corner_views(lamp: &Lamp, scene: &Scene, side_px: u32) -> anyhow::Result<Vec<Pinhole>> {
    let eyes = lamp.area.corners_world(lamp.middle_world);
    one_face(lamp, scene, &eyes, side_px)
}

/// The middle's view, for layers.
pub(super) fn middle_view(lamp: &Lamp, scene: &Scene, side_px: u32) -> anyhow::Result<Pinhole> {
    Ok(one_face(lamp, scene, &[lamp.middle_world], side_px)?[0])
}

/// The views of all of the lamp's points.
pub(super) fn point_views(lamp: &Lamp, scene: &Scene, points: u32, side_px: u32) -> anyhow::Result<Vec<Pinhole>> {
    let eyes: Vec<DVec3> = lamp.area.points_world(lamp.middle_world, points).collect();
    one_face(lamp, scene, &eyes, side_px)
}

fn one_face(lamp: &Lamp, scene: &Scene, eyes: &[DVec3], side_px: u32) -> anyhow::Result<Vec<Pinhole>> {
    only_face(parallel_views(eyes, lamp.area.half_world.map(DVec3::from), bounds(scene), side_px))
}

/// The views of the only face that a lamp sees the scene by.
pub(super) fn only_face(mut faces: Vec<Vec<Pinhole>>) -> anyhow::Result<Vec<Pinhole>> {
    anyhow::ensure!(faces.len() == 1, "the lamp sees the scene by {} faces; one is meant", faces.len());
    Ok(faces.remove(0))
}

/// What a lamp's images and maps hold.
pub(super) fn bounds(scene: &Scene) -> Bounds {
    Bounds { min: scene.bounds.min, max: scene.bounds.max }
}

/// All of the scene, a little from above.
pub(super) fn output(scene: &Scene, (width_px, height_px): (u32, u32)) -> Pinhole {
    let (centre, radius_m) = (scene.bounds.centre(), scene.bounds.radius_m());
    let back = DVec3::new(0.5, 0.8, 1.0).normalize();
    // Seen as a ball it would fit at twice the radius; scenes are flat.
    let eye = centre + back * (1.5 * radius_m);
    Pinhole::symmetric(Rigid::look_at(eye, centre), (width_px, height_px), FIELD_RAD, 1e-3 * radius_m)
}
