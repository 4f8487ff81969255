use glam::{DVec2, DVec3, Mat4, Vec4};
use serde::{Deserialize, Serialize};

use crate::Rigid;

/// An image point with its inverse depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePoint {
    /// Pixels from the left edge.
    pub u: f64,
    /// Pixels from the top edge.
    pub v: f64,
    /// Inverse depth in the camera's own measure; `1/z` in 1/m for a pinhole.
    pub w: f64,
}

/// A planar pinhole camera with square pixels. It has no far plane: `w` reaches 0 at infinity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pinhole {
    /// Where the eye is and how it is turned.
    pub world_from_eye: Rigid,
    /// Image width.
    pub width_px: u32,
    /// Image height.
    pub height_px: u32,
    /// Focal length in pixels, the same along u and v.
    pub focal_px: f64,
    /// Where the optical axis meets the image; the middle of the image for a symmetric view.
    pub centre_px: DVec2,
    /// Points nearer than this have no image.
    pub near_m: f64,
}

impl Pinhole {
    /// A symmetric view with the vertical field of view `fov_y_rad` (0 to pi).
    pub fn symmetric(world_from_eye: Rigid, (width_px, height_px): (u32, u32), fov_y_rad: f64, near_m: f64) -> Pinhole {
        Pinhole {
            world_from_eye,
            width_px,
            height_px,
            focal_px: f64::from(height_px) / 2.0 / (fov_y_rad / 2.0).tan(),
            centre_px: DVec2::new(f64::from(width_px), f64::from(height_px)) / 2.0,
            near_m,
        }
    }

    /// The ray `(x', y', 1)` of an image point, in eye space; `z` times the ray is the point at depth `z`.
    pub fn ray_eye_from_image(&self, u: f64, v: f64) -> DVec3 {
        DVec3::new((u - self.centre_px.x) / self.focal_px, (v - self.centre_px.y) / self.focal_px, 1.0)
    }

    /// Where a point of eye space lands; `None` nearer than the near plane. The point may lie outside of the image.
    pub fn image_from_eye(&self, p_eye: DVec3) -> Option<ImagePoint> {
        (p_eye.z >= self.near_m).then(|| {
            let w = 1.0 / p_eye.z;
            let u = self.centre_px.x + self.focal_px * p_eye.x * w;
            let v = self.centre_px.y + self.focal_px * p_eye.y * w;
            ImagePoint { u, v, w }
        })
    }

    /// The point of eye space at an image point; `w` must be positive.
    pub fn eye_from_image(&self, point: ImagePoint) -> DVec3 {
        self.ray_eye_from_image(point.u, point.v) / point.w
    }

    /// Where a world point lands; see [`Pinhole::image_from_eye`].
    pub fn image_from_world(&self, p_world: DVec3) -> Option<ImagePoint> {
        self.image_from_eye(self.world_from_eye.inverse().transform_point(p_world))
    }

    /// The world point at an image point.
    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        self.world_from_eye.transform_point(self.eye_from_image(point))
    }

    /// Whether an image point lies inside of the image.
    pub fn contains(&self, point: ImagePoint) -> bool {
        point.u >= 0.0 && point.v >= 0.0 && point.u < f64::from(self.width_px) && point.v < f64::from(self.height_px)
    }

    /// Whether a ball in eye space may have an image: whether it reaches into the pyramid of the view.
    pub fn may_see_ball(&self, centre_eye: DVec3, radius_m: f64) -> bool {
        let p = centre_eye;
        let corner_px = DVec2::new(self.width_px.into(), self.height_px.into());
        // Tangents of the sides: left and top are negative for a centre inside of the image.
        let (low, high) = (-self.centre_px / self.focal_px, (corner_px - self.centre_px) / self.focal_px);
        let outside = |across: f64, tangent: f64| (across - tangent * p.z) / tangent.hypot(1.0);
        let farthest =
            outside(p.x, high.x).max(-outside(p.x, low.x)).max(outside(p.y, high.y)).max(-outside(p.y, low.y));
        farthest <= radius_m && p.z >= -radius_m
    }

    /// The projection for the rasterizer: reversed, infinite depth, `depth = near * w`, so a depth buffer of f32 keeps the
    /// relative precision of `w` at every distance. Front faces stay counter-clockwise.
    pub fn clip_from_eye(&self) -> Mat4 {
        let (width, height) = (f64::from(self.width_px), f64::from(self.height_px));
        let (x, y) = (2.0 * self.focal_px / width, -2.0 * self.focal_px / height);
        let (cx, cy) = (2.0 * self.centre_px.x / width - 1.0, 1.0 - 2.0 * self.centre_px.y / height);
        Mat4::from_cols(
            Vec4::new(x as f32, 0.0, 0.0, 0.0),
            Vec4::new(0.0, y as f32, 0.0, 0.0),
            Vec4::new(cx as f32, cy as f32, 0.0, 1.0),
            Vec4::new(0.0, 0.0, self.near_m as f32, 0.0),
        )
    }

    /// Vertical field of view in radians.
    pub fn fov_y_rad(&self) -> f64 {
        2.0 * (f64::from(self.height_px) / 2.0 / self.focal_px).atan()
    }

    /// Whether every field is finite and in range: bytes from outside may hold anything.
    pub fn is_valid(&self) -> bool {
        self.world_from_eye.is_valid()
            && self.width_px > 0
            && self.height_px > 0
            && self.focal_px.is_finite()
            && self.focal_px > 0.0
            && self.centre_px.is_finite()
            && self.near_m.is_finite()
            && self.near_m > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_with_a_point_in_the_image_may_be_seen_and_one_beside_the_view_is_not() {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (64, 48), 1.0, 0.1);
        let view = Pinhole { centre_px: DVec2::new(20.0, 30.0), ..view };
        let steps = |from: f64| (0..7).map(move |step| from + f64::from(step) * 1.3);
        let places =
            || steps(-4.0).flat_map(|x| steps(-4.0).flat_map(move |y| steps(-3.0).map(move |z| DVec3::new(x, y, z))));
        let mut seen = 0;
        for centre in places() {
            let has_image = |offset: DVec3| {
                view.image_from_eye(centre + offset.normalize_or_zero()).is_some_and(|point| view.contains(point))
            };
            if places().any(has_image) {
                assert!(view.may_see_ball(centre, 1.0), "{centre}");
            }
            seen += usize::from(view.may_see_ball(centre, 1.0));
        }
        assert!(seen < 7 * 7 * 7 / 2, "{seen} are seen");
        assert!(!view.may_see_ball(DVec3::new(0.0, 0.0, -1.1), 1.0), "behind the eye");
    }
}
