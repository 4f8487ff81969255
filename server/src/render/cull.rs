//! What a camera cannot see is not drawn: on a software rasterizer vertices cost as much as pixels.

use camera::Pinhole;
use glam::{DAffine3, DVec3, Vec3};
use scene::{Bounds, Vertex};

/// The half spaces of a pinhole's view, in world space.
pub(crate) struct Frustum {
    eye_world: DVec3,
    /// Pointing inwards, through the eye: left, right, top, bottom.
    sides_world: [DVec3; 4],
    forward_world: DVec3,
    near_m: f64,
}

impl Frustum {
    pub(crate) fn new(camera: &Pinhole) -> Frustum {
        let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
        let low = camera.ray_eye_from_image(0.0, 0.0);
        let high = camera.ray_eye_from_image(width, height);
        let world = |v: DVec3| camera.world_from_eye.transform_vector(v);
        Frustum {
            eye_world: camera.world_from_eye.translation,
            sides_world: [
                world(DVec3::new(1.0, 0.0, -low.x)),
                world(DVec3::new(-1.0, 0.0, high.x)),
                world(DVec3::new(0.0, 1.0, -low.y)),
                world(DVec3::new(0.0, -1.0, high.y)),
            ],
            forward_world: world(DVec3::Z),
            near_m: camera.near_m,
        }
    }

    /// False only where the whole box lies on the outer side of one plane.
    pub(crate) fn may_see(&self, bounds: &Bounds) -> bool {
        if bounds.is_empty() {
            return false;
        }
        let (low, high) = (bounds.min - self.eye_world, bounds.max - self.eye_world);
        let farthest = |normal: DVec3| DVec3::select(normal.cmpgt(DVec3::ZERO), high, low).dot(normal);
        // Rounding in f32 on the GPU must not find what this dropped.
        // A place that is as far from the eye as the anchor is goes through some sixteen roundings of 2^-24 before it is in the image, 1e-6 of its way: this is ten times that.
        let slack = 1e-5 * low.abs().max(high.abs()).max_element();
        self.sides_world.iter().all(|&side| farthest(side) >= -slack)
            && farthest(self.forward_world) >= self.near_m - slack
    }
}

/// The box of a mesh's vertices.
pub(crate) fn mesh_bounds(vertices: &[Vertex]) -> [Vec3; 2] {
    let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    vertices.iter().map(|vertex| Vec3::from(vertex.position)).fold(empty, |[low, high], p| [low.min(p), high.max(p)])
}

/// The world's box around a mapped box; empty stays empty.
pub(crate) fn world_bounds(world_from_mesh: &DAffine3, [low, high]: [Vec3; 2]) -> Bounds {
    if low.cmpgt(high).any() {
        return Bounds::EMPTY;
    }
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let centre = world_from_mesh.transform_point3((low + high) / 2.0);
    let half = (high - low) / 2.0;
    let linear = world_from_mesh.matrix3;
    let reach = linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
    Bounds { min: centre - reach, max: centre + reach }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camera::Rigid;

    #[test]
    fn a_frustum_keeps_what_projects_into_the_image() {
        let eye = DVec3::new(3.0, -2.0, 5.0);
        let camera = Pinhole::symmetric(Rigid::look_along(eye, DVec3::new(1.0, 0.4, -0.7)), (64, 48), 1.0, 0.5);
        let frustum = Frustum::new(&camera);
        let mut seen = 0;
        for index in 0..4000 {
            let mixed = |step: u32| f64::from((index * step + step / 3) % 101) / 50.0 - 1.0;
            let centre = eye + 8.0 * DVec3::new(mixed(37), mixed(53), mixed(71));
            let half = DVec3::splat(0.02);
            let bounds = Bounds { min: centre - half, max: centre + half };
            let inside = camera.image_from_world(centre).is_some_and(|point| camera.contains(point));
            assert!(!inside || frustum.may_see(&bounds), "dropped {centre}");
            seen += u32::from(frustum.may_see(&bounds));
        }
        assert!(seen > 50 && seen < 1500, "{seen} of 4000 boxes kept");
    }
}
