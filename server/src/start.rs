//! Where a viewer begins, and the nearest thing it may see.

use camera::Rigid;
use glam::{DAffine3, DVec3};
use scene::{Scene, Vertex};

/// Height of a walker's eyes above the ground.
const EYE_HEIGHT_M: f64 = 1.7;
/// Part of half of the view's height that an object reaches out to at the beginning.
const FRAME_SHARE: f64 = 2.0 / 3.0;
/// Half of a view's height at a distance of 1: of the 60 degrees that viewers begin with.
const HALF_HEIGHT: f64 = 0.577_350_269;
/// Of scenes with more vertices than this, some are taken for all.
const MAX_FRAMED_VERTICES: usize = 1 << 21;
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
    let back = DVec3::new(0.5, 0.4, 1.0).normalize();
    let from_afar = Rigid::look_at(centre + back, centre);
    Rigid::look_at(centre + back * framing_distance_m(scene, from_afar, centre), centre)
}

/// How far from the middle an eye that looks there sees all within [`FRAME_SHARE`] of its view: a point that lies `x` beside or above the way, and `toward`
/// nearer than the middle, does from `x / (share * half height) + toward` on.
fn framing_distance_m(scene: &Scene, world_from_eye: Rigid, centre: DVec3) -> f64 {
    let snapshot = scene.at(0.0);
    let mut vertices: Vec<&[Vertex]> =
        scene.instances.iter().map(|instance| scene.meshes[instance.mesh as usize].vertices.as_slice()).collect();
    for deformed in &snapshot.deformed {
        vertices[deformed.instance as usize] = &deformed.vertices;
    }
    let step = vertices.iter().map(|vertices| vertices.len()).sum::<usize>().div_ceil(MAX_FRAMED_VERTICES).max(1);
    let eye_from_world = world_from_eye.rotation.inverse();
    let of_instance = |(vertices, world_from_mesh): (&&[Vertex], &DAffine3)| {
        let distance_m = |vertex: &Vertex| {
            let world = world_from_mesh.transform_point3(DVec3::from(vertex.position.map(f64::from)));
            let beside = eye_from_world * (world - centre);
            beside.x.abs().max(beside.y.abs()) / (FRAME_SHARE * HALF_HEIGHT) - beside.z
        };
        vertices.iter().step_by(step).map(distance_m).fold(0.0, f64::max)
    };
    let distances_m = vertices.iter().zip(&snapshot.world_from_mesh).map(of_instance);
    // No nearer than what is in the middle of it.
    distances_m.fold(scene.bounds.radius_m() * NEAR_SHARE, f64::max)
}

/// Nearest distance that is drawn.
pub fn near_m(scene: &Scene) -> f64 {
    let share_m = scene.bounds.radius_m() * NEAR_SHARE;
    if share_m > 0.0 { share_m.min(NEAR_M) } else { NEAR_M }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far from the middle of the view the scene reaches, in halves of its height.
    fn reach(scene: &Scene) -> f64 {
        let eye_from_world = start_pose(scene).inverse();
        let snapshot = scene.at(0.0);
        let of_instance = |(instance, world_from_mesh): (&scene::Instance, &DAffine3)| {
            let vertices = &scene.meshes[instance.mesh as usize].vertices;
            let reach = |vertex: &Vertex| {
                let world = world_from_mesh.transform_point3(DVec3::from(vertex.position.map(f64::from)));
                let eye = eye_from_world.transform_point(world);
                assert!(eye.z > 0.0, "all is in front");
                eye.x.abs().max(eye.y.abs()) / (eye.z * HALF_HEIGHT)
            };
            vertices.iter().map(reach).fold(0.0, f64::max)
        };
        scene.instances.iter().zip(&snapshot.world_from_mesh).map(of_instance).fold(0.0, f64::max)
    }

    #[test]
    fn an_object_fills_two_thirds_of_the_first_view() {
        let mut framed = 0;
        for mut scene in scene::builtin::names().filter_map(scene::builtin::load).filter(|scene| !scene.walk) {
            (scene.start, framed) = (None, framed + 1);
            scene.cameras.clear();
            let found = reach(&scene);
            assert!((found - FRAME_SHARE).abs() < 1e-6, "{found} in {}", scene.name);
        }
        assert!(framed > 2, "built-in scenes of objects");
    }
}
