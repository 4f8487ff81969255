//! Where a viewer begins, and the nearest thing it may see.

use camera::Rigid;
use glam::DVec3;
use scene::Scene;

/// Height of a walker's eyes above the ground.
const EYE_HEIGHT_M: f64 = 1.7;
/// Half of the field that an object must fit in at the beginning: 25 degrees leave a border in a view of 60.
const FRAME_HALF_FIELD_RAD: f64 = 0.436;
/// The nearest distance to be drawn for a walker: a wall that the nose touches.
const NEAR_M: f64 = 0.05;
/// The same for small objects, as a share of the bounding radius.
const NEAR_SHARE: f64 = 1e-3;

/// `world_from_eye` of a new viewer: the scene's own suggestion, else the middle of a scene to walk in, else a place from
/// which the whole object is seen, a little from above.
pub fn start_pose(scene: &Scene) -> Rigid {
    if let Some(start) = scene.start.or_else(|| scene.cameras.first().copied()) {
        return Rigid::look_along(start.eye_world, start.forward_world);
    }
    if scene.bounds.is_empty() {
        return Rigid::IDENTITY;
    }
    let (centre, extent) = (scene.bounds.centre(), scene.bounds.max - scene.bounds.min);
    if scene.walk {
        let height_m = EYE_HEIGHT_M.min(extent.y * 0.5);
        let eye = DVec3::new(centre.x, scene.bounds.min.y + height_m, centre.z);
        let along = if extent.x > extent.z { DVec3::X } else { DVec3::NEG_Z };
        return Rigid::look_along(eye, along);
    }
    let distance_m = scene.bounds.radius_m() / FRAME_HALF_FIELD_RAD.sin();
    let back = DVec3::new(0.5, 0.4, 1.0).normalize();
    Rigid::look_at(centre + back * distance_m, centre)
}

/// Nearest distance that is drawn.
pub fn near_m(scene: &Scene) -> f64 {
    let share_m = scene.bounds.radius_m() * NEAR_SHARE;
    if share_m > 0.0 { share_m.min(NEAR_M) } else { NEAR_M }
}
