//! Images for a flat mirror: from where the eye's mirror image is.
//!
//! Every ray that the viewer sees reflected by a plane goes on as if it came from the mirror image of the eye, so an image from there holds
//! just what the mirror shows, each thing as finely as it is seen; from the mirror's middle, a lake's shore would be seen from another
//! side. The mirror itself is left out. Faces of a cube along the plane's normal, with the near plane at the eye's distance from the mirror, begin
//! at the mirror: what stands over the plane is never nearer along the axis of the face that it falls in. The face behind the mirror is left out.

use camera::{Bounds, Camera, Pinhole, Rigid};
use glam::{DMat3, DQuat, DVec3};

/// A right angle has half as many pixels on each side of the middle: 256 a unit of the tangent, about as a view of 600 lines at 100 degrees has.
const FACE_PX: u32 = 512;

/// A plane by a point and a unit normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub point_world: DVec3,
    pub normal_world: DVec3,
}

impl Plane {
    fn height_m(&self, p_world: DVec3) -> f64 {
        (p_world - self.point_world).dot(self.normal_world)
    }

    /// Whether a part of a box is on the side of the plane that a viewer is on.
    pub fn is_before(&self, bounds: &Bounds, viewer_world: DVec3) -> bool {
        let side = self.height_m(viewer_world).signum();
        let (middle, half) = (bounds.middle(), (bounds.max - bounds.min) / 2.0);
        side * self.height_m(middle) + half.dot(self.normal_world.abs()) > 0.0
    }

    /// Where a point seems to be in the mirror, and how far it is from it, metres.
    pub fn mirrored(&self, p_world: DVec3) -> (DVec3, f64) {
        let height_m = self.height_m(p_world);
        (p_world - self.normal_world * (2.0 * height_m), height_m.abs())
    }

    /// What a viewer sees in it; nothing where the eye lies in the plane.
    pub fn cameras(&self, eye_world: DVec3) -> Vec<Camera> {
        let (mirrored, near_m) = self.mirrored(eye_world);
        if near_m <= 0.0 {
            return Vec::new();
        }
        let up = self.normal_world * self.height_m(eye_world).signum();
        let (across, along) = up.any_orthonormal_pair();
        // A pixel more than a right angle on each side, so that faces overlap instead of leaving a seam.
        let half = f64::from(FACE_PX) / 2.0;
        let fov_rad = 2.0 * (half / (half - 1.0)).atan();
        let face = |(forward, right): (DVec3, DVec3)| {
            let rotation = DQuat::from_mat3(&DMat3::from_cols(right, forward.cross(right), forward)).normalize();
            let world_from_eye = Rigid { rotation, translation: mirrored };
            Camera::Pinhole(Pinhole::symmetric(world_from_eye, (FACE_PX, FACE_PX), fov_rad, near_m))
        };
        [(up, across), (across, along), (-across, along), (along, across), (-along, across)].map(face).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_over_the_mirror_falls_into_a_face_and_what_is_under_it_does_not() {
        let plane = Plane { point_world: DVec3::new(1.0, 2.0, 3.0), normal_world: DVec3::new(0.6, 0.8, 0.0) };
        let eye_world = plane.point_world + plane.normal_world * 1.5;
        let cameras = plane.cameras(eye_world);
        let (across, along) = plane.normal_world.any_orthonormal_pair();
        let seen = |height_m: f64, a: f64, b: f64| {
            let p_world = plane.point_world + plane.normal_world * height_m + across * a + along * b;
            let is_seen = |camera: &&Camera| {
                let Camera::Pinhole(camera) = camera else { return false };
                camera.image_from_world(p_world).is_some_and(|point| camera.contains(point))
            };
            cameras.iter().filter(is_seen).count()
        };
        for (a, b) in [(0.0, 0.0), (4.0, 1.0), (-3.0, 0.5), (0.2, 9.0), (-1.0, -30.0)] {
            assert!(seen(0.01, a, b) >= 1 && seen(5.0, a, b) >= 1, "({a}, {b})");
        }
        assert_eq!(seen(-0.01, 0.0, 0.0), 0, "below the mirror, under the eye");
    }
}
