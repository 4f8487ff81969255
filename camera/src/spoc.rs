//! The single-pole occlusion camera: one image of an object that also holds what lies just behind its silhouette.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 4; Popescu,
//! Hayward, Rosen, Wyman, *Non-pinhole impostors* (2009), section 4. A pinhole projects a point; then the image point is
//! pushed away from the *pole*, where the object's centre projects to, and the further the deeper the point lies. So
//! samples behind the silhouette come out from behind it.
//!
//! | papers | here |
//! |---|---|
//! | pole | [`Spoc::pole_px`] |
//! | distortion magnitude | [`Spoc::push_px`], `D` below |
//!
//! **Deviation.** The papers push every point by the same `D` at one depth. That has no direction at the pole and leaves a
//! hole of radius `D` around it. Here the push grows over a ramp, from nothing at the pole to `D` at a distance of `rho_0` =
//! [`Spoc::ramp_px`]; with `rho` the distance from the pole before and `rho_d` the one after it:
//!
//! `rho_d = rho + D min(1, rho/rho_0) = rho (1 + D/max(rho, rho_0))`, `D = d_max clamp((1/z_n - w)/(1/z_n - 1/z_f), 0, 1)`
//!
//! **One-to-one.** The depth `w = 1/z` is that of the pinhole. At one depth, `D >= 0` is a constant, and `rho_d` is
//! continuous and grows with `rho` at a rate of `1 + D/rho_0` in the ramp and 1 outside of it; directions from the pole stay.
//! So every image point comes from exactly one point at each depth: `rho = rho_d/(1 + D/rho_0)` where `rho_d <= rho_0 + D`,
//! otherwise `rho = rho_d - D`. Both rates, along and across the direction from the pole, are at least 1: two points of one
//! depth are never nearer in this image than in the pinhole's.
//!
//! **Length.** The same rates are at most `1 + D/rho_0`, and the push itself changes by at most `|dD|`. Along a segment `D` is
//! monotone, as `w` is. So the curve that a segment projects to is no longer than `(1 + D/rho_0) L + |D_b - D_a|`, with `L` the
//! length of its straight pinhole image and `D` the greater one of its ends ([`Spoc::length_bound_px`]). The distance between
//! the images of its ends, which the papers count steps by, can be too short.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::convex::corners;
use crate::{Bounds, HalfSpace, ImageBounds, ImagePoint, Pinhole, Rigid};

/// A pinhole whose image points are pushed away from a pole, the further the deeper. See the module's words.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spoc {
    /// What projects before the push. Its image is also this camera's: size, and what lies inside.
    pub pinhole: Pinhole,
    /// What points are pushed away from, in pixels; where the centre of the object projects to.
    pub pole_px: DVec2,
    /// Up to this depth along the optical axis (metres) nothing is pushed.
    pub push_from_m: f64,
    /// From this depth on everything is pushed by [`Spoc::push_max_px`]; greater than [`Spoc::push_from_m`].
    pub push_to_m: f64,
    /// How far the deepest points are pushed, in pixels; 0 makes a pinhole.
    pub push_max_px: f64,
    /// How far from the pole the push has its full length, in pixels; positive.
    pub ramp_px: f64,
}

impl Spoc {
    /// A camera for one object: seen from `eye_world`, and all around its silhouette as from a circle of eyes with the radius
    /// `ring_m`. The pole is at the object's centre, the push begins at the front of the sphere around its bounds and ends at
    /// the back, and the image is as wide as the shorter side of `size_px` allows.
    ///
    /// The papers tune the push by hand. Here it follows from the ring: while it grows, a ray outside of the ramp has the
    /// distance `z (rho_d - b/z_n)/f + b/f` from the line of sight to the pole, `b = d_max/(1/z_n - 1/z_f)`. So all of them come from
    /// `b/f` beside the eye, on their side, and `b = f ring_m`. Of a ball of radius `R` in the distance `d` comes into view what
    /// lies up to `atan(ring_m/d) + acos(R/hypot(d, ring_m))` from the direction of the eye; with `ring_m = R`, half of it.
    ///
    /// The ramp is half of the object's silhouette: the push has its full length where it matters, and nothing is stretched
    /// by more than `1 + d_max/rho_0`.
    ///
    /// `None` where the eye is not outside of the sphere, the bounds hold nothing, or a number is out of range.
    pub fn around(bounds: &Bounds, eye_world: DVec3, size_px: (u32, u32), ring_m: f64) -> Option<Spoc> {
        let distance_m = bounds.middle().distance(eye_world);
        let radius_m = (bounds.max - bounds.min).length() / 2.0;
        let (front_m, back_m) = (distance_m - radius_m, distance_m + radius_m);
        if !(radius_m > 0.0 && front_m > 0.0 && ring_m >= 0.0) {
            return None;
        }
        // Lengths in the image with a focal length of one pixel; all of them grow with it.
        let push = |z_m: f64| ring_m * (1.0 / front_m - 1.0 / z_m);
        let half_image_px = f64::from(size_px.0.min(size_px.1)) / 2.0;
        let focal_px = half_image_px / reach_of_pushed_sphere(distance_m, radius_m, push);
        let centre_px = DVec2::new(size_px.0.into(), size_px.1.into()) / 2.0;
        let silhouette = radius_m / (front_m * back_m).sqrt();
        let camera = Spoc {
            pinhole: Pinhole {
                world_from_eye: Rigid::look_at(eye_world, bounds.middle()),
                width_px: size_px.0,
                height_px: size_px.1,
                focal_px,
                centre_px,
                // Well before the object: inverse depth loses nothing by it.
                near_m: front_m / 2.0,
            },
            pole_px: centre_px,
            push_from_m: front_m,
            push_to_m: back_m,
            push_max_px: focal_px * push(back_m),
            ramp_px: focal_px * silhouette / 2.0,
        };
        camera.is_valid().then_some(camera)
    }

    /// `D`: how far a point of inverse depth `w` (1/m) is pushed outside of the ramp, in pixels.
    pub fn push_px(&self, w: f64) -> f64 {
        let (w_from, w_to) = (1.0 / self.push_from_m, 1.0 / self.push_to_m);
        self.push_max_px * ((w_from - w) / (w_from - w_to)).clamp(0.0, 1.0)
    }

    /// Where a world point lands; `None` nearer than the pinhole's near plane, or where a coordinate is not finite. The point
    /// may lie outside of the image.
    pub fn image_from_world(&self, p_world: DVec3) -> Option<ImagePoint> {
        let pushed = self.image_from_straight(self.pinhole.image_from_world(p_world)?);
        (pushed.u.is_finite() && pushed.v.is_finite() && pushed.w > 0.0).then_some(pushed)
    }

    /// Where the push takes an image point of the pinhole.
    pub fn image_from_straight(&self, straight: ImagePoint) -> ImagePoint {
        let offset_px = DVec2::new(straight.u, straight.v) - self.pole_px;
        let pushed = self.pole_px + offset_px * (1.0 + self.push_px(straight.w) / offset_px.length().max(self.ramp_px));
        ImagePoint { u: pushed.x, v: pushed.y, w: straight.w }
    }

    /// The world point at an image point; `w` must be positive.
    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        let pushed_px = DVec2::new(point.u, point.v) - self.pole_px;
        let (pushed_by_px, distance_px) = (self.push_px(point.w), pushed_px.length());
        let share = if distance_px <= self.ramp_px + pushed_by_px {
            1.0 / (1.0 + pushed_by_px / self.ramp_px)
        } else {
            1.0 - pushed_by_px / distance_px
        };
        let straight = self.pole_px + pushed_px * share;
        self.pinhole.world_from_image(ImagePoint { u: straight.x, v: straight.y, w: point.w })
    }

    /// All points that land at `(u, v)` pixels.
    pub fn ray(&self, u: f64, v: f64) -> SpocRay {
        SpocRay { camera: *self, u, v }
    }

    /// An upper bound of the length, in pixels, of the curve that a world segment projects to; `None` where an end has no
    /// image. See the module's words.
    pub fn length_bound_px(&self, a_world: DVec3, b_world: DVec3) -> Option<f64> {
        let (a, b) = (self.pinhole.image_from_world(a_world)?, self.pinhole.image_from_world(b_world)?);
        let straight_px = DVec2::new(b.u - a.u, b.v - a.v).length();
        let (push_a_px, push_b_px) = (self.push_px(a.w), self.push_px(b.w));
        let bound_px = (1.0 + push_a_px.max(push_b_px) / self.ramp_px) * straight_px + (push_b_px - push_a_px).abs();
        bound_px.is_finite().then_some(bound_px)
    }

    /// Bounds of the image of a box, at least as large as it is: of the part beyond the near plane, every point pushed as far
    /// as the deepest. `None` where the whole box is nearer.
    pub fn image_bounds(&self, bounds: &Bounds) -> Option<ImageBounds> {
        let forward = self.pinhole.world_from_eye.transform_vector(DVec3::Z);
        let near = self.pinhole.world_from_eye.translation + forward * self.pinhole.near_m;
        let mut body = bounds.half_spaces().to_vec();
        body.push(HalfSpace { point: near, outward: -forward });
        // What rounding puts before the near plane lies on it.
        let on_or_behind = |corner: DVec3| {
            let eye = self.pinhole.world_from_eye.inverse().transform_point(corner);
            self.pinhole.image_from_eye(eye.with_z(eye.z.max(self.pinhole.near_m)))
        };
        let straight = ImageBounds::around(corners(&body).into_iter().filter_map(on_or_behind))?;
        let push_px = self.push_px(straight.w_min);
        // Along one axis a point moves by `D x/max(rho, rho_0)`, with `rho >= |x|`: outwards, and never further than this.
        let outwards = |offset_px: DVec2| offset_px * push_px / offset_px.abs().max(DVec2::splat(self.ramp_px));
        let low = (straight.min_px - self.pole_px).min(DVec2::ZERO);
        let high = (straight.max_px - self.pole_px).max(DVec2::ZERO);
        Some(ImageBounds {
            min_px: straight.min_px + outwards(low),
            max_px: straight.max_px + outwards(high),
            ..straight
        })
    }

    /// Whether every field is finite and in range: bytes from outside may hold anything.
    pub fn is_valid(&self) -> bool {
        self.pinhole.is_valid()
            && self.pole_px.is_finite()
            && self.push_from_m > 0.0
            && self.push_from_m < self.push_to_m
            && self.push_to_m.is_finite()
            && 1.0 / self.push_from_m > 1.0 / self.push_to_m
            && (1.0 / self.push_from_m).is_finite()
            && self.push_max_px >= 0.0
            && self.ramp_px > 0.0
            && self.ramp_px.is_finite()
            && (self.push_max_px / self.ramp_px).is_finite()
    }
}

/// How far from the pole a sphere around it reaches, pushed by `push(z_m)`, in an image with a focal length of one pixel: at
/// least as far as it does, and by less than the push changes in a 64th of the sphere's depth.
fn reach_of_pushed_sphere(distance_m: f64, radius_m: f64, push: impl Fn(f64) -> f64) -> f64 {
    const SLICES: u32 = 64;
    let front_m = distance_m - radius_m;
    let depth_m = |slice: u32| front_m + 2.0 * radius_m * f64::from(slice) / f64::from(SLICES);
    // The image of the sphere's cross-section grows with depth up to the silhouette and shrinks behind it.
    let silhouette_m = front_m * (distance_m + radius_m) / distance_m;
    let cross_section = |z_m: f64| (radius_m.powi(2) - (z_m - distance_m).powi(2)).max(0.0).sqrt() / z_m;
    (0..SLICES)
        .map(|slice| (depth_m(slice), depth_m(slice + 1)))
        .map(|(from_m, to_m)| cross_section(silhouette_m.clamp(from_m, to_m)) + push(to_m))
        .fold(0.0, f64::max)
}

/// The points that a [`Spoc`] shows at one image point: a curve on which depth grows. It lies in the plane of the pole's ray
/// and has kinks where the push begins and ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpocRay {
    camera: Spoc,
    u: f64,
    v: f64,
}

/// A stretch of a [`SpocRay`] without a kink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpocRayPiece {
    /// Where it begins, as depth along the optical axis in metres.
    pub from_m: f64,
    /// Where it ends; infinite for the last one.
    pub to_m: f64,
    /// Whether it is surely a piece of a straight line. Only inside of the ramp, while the push grows, a ray is curved.
    pub is_straight: bool,
}

impl SpocRay {
    /// The world point of the ray at a depth along the optical axis, in metres.
    pub fn world_at(&self, z_m: f64) -> DVec3 {
        self.camera.world_from_image(ImagePoint { u: self.u, v: self.v, w: 1.0 / z_m })
    }

    /// The ray's pieces from the near plane to infinity, near to far: before the push, while it grows (straight outside of the
    /// ramp, curved from where the ray enters it), and behind. Empty ones are left out.
    pub fn pieces(&self) -> Vec<SpocRayPiece> {
        let camera = &self.camera;
        let near_m = camera.pinhole.near_m;
        let from_m = camera.push_from_m.max(near_m);
        let to_m = camera.push_to_m.max(from_m);
        // It enters the ramp where `D = rho_d - rho_0`.
        let distance_px = DVec2::new(self.u, self.v).distance(camera.pole_px);
        let share = (distance_px - camera.ramp_px) / camera.push_max_px;
        let ramp_m = if share <= 0.0 {
            from_m
        } else if share < 1.0 {
            let (w_from, w_to) = (1.0 / camera.push_from_m, 1.0 / camera.push_to_m);
            (1.0 / (w_from - share * (w_from - w_to))).clamp(from_m, to_m)
        } else {
            to_m
        };
        [(near_m, from_m, true), (from_m, ramp_m, true), (ramp_m, to_m, false), (to_m, f64::INFINITY, true)]
            .into_iter()
            .filter(|(from_m, to_m, _)| from_m < to_m)
            .map(|(from_m, to_m, is_straight)| SpocRayPiece { from_m, to_m, is_straight })
            .collect()
    }
}
