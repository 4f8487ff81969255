//! The projection of a straight stretch of a ray: a straight line in the image of a pinhole or frustum, pushed away from the
//! pole where the camera has one.
//!
//! It is parametrized by `s`, 0 to 1, evenly along the *straight* image. There `w` is linear in `s`, whether pushed or not,
//! and with `z = 1/w` linear along the ray, `t = t_0 + (t_1 - t_0) s w_1/w(s)`.

use ::camera::{Camera, GraphCamera, ImagePoint, Pinhole, Spoc};
use glam::DVec2;

use crate::pyramid::Range;
use crate::ray::Ray;

/// No curve is halved more often, nor cut into more steps than so many halvings make: a quarter of a pixel of the diagonal of the
/// largest image that GPUs are sure to hold (8192 pixels).
pub(crate) const MAX_HALVINGS: u32 = 16;
pub(crate) const MAX_STEPS: u32 = 1 << MAX_HALVINGS;

/// The curves that a finite ray projects to, in the order of `t`: one behind the near plane, or one for each frustum that it
/// crosses.
pub(crate) fn curves<'a>(camera: &'a Camera, ray: &Ray) -> Vec<Curve<'a>> {
    match camera {
        Camera::Pinhole(camera) => Curve::of_pinhole(camera, ray, None).into_iter().collect(),
        Camera::Spoc(camera) => Curve::of_pinhole(&camera.pinhole, ray, Some(camera)).into_iter().collect(),
        Camera::Graph(camera) => Curve::of_graph(camera, ray),
    }
}

/// See the module's words.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<'a> {
    from: End,
    to: End,
    spoc: Option<&'a Spoc>,
    /// Whether the ray goes on behind the curve's end, but the camera does not: a wall where frusta end may stand just there.
    pub ends_open: bool,
}

/// An end of a curve, before the push.
#[derive(Debug, Clone, Copy)]
struct End {
    straight_px: DVec2,
    w: f64,
    t: f64,
}

impl End {
    fn new(point: ImagePoint, t: f64) -> Option<End> {
        let is_finite = point.u.is_finite() && point.v.is_finite() && point.w.is_finite() && point.w > 0.0;
        is_finite.then_some(End { straight_px: DVec2::new(point.u, point.v), w: point.w, t })
    }
}

impl<'a> Curve<'a> {
    /// The curve of what lies behind the near plane.
    pub fn of_pinhole(camera: &Pinhole, ray: &Ray, spoc: Option<&'a Spoc>) -> Option<Curve<'a>> {
        let eye_from_world = camera.world_from_eye.inverse();
        let z_m = |t: f64| eye_from_world.transform_point(ray.at(t)).z;
        let (z_from_m, z_to_m) = (z_m(ray.t_from), z_m(ray.t_to));
        let t_near = ray.t_from + (ray.t_to - ray.t_from) * (camera.near_m - z_from_m) / (z_to_m - z_from_m);
        let (t_from, t_to) = match (z_from_m < camera.near_m, z_to_m < camera.near_m) {
            (true, true) => return None,
            (true, false) => (t_near, ray.t_to),
            (false, true) => (ray.t_from, t_near),
            (false, false) => (ray.t_from, ray.t_to),
        };
        let end = |t: f64| {
            let mut p_eye = eye_from_world.transform_point(ray.at(t));
            p_eye.z = p_eye.z.max(camera.near_m); // what rounding put before the plane lies on it
            End::new(camera.image_from_eye(p_eye)?, t)
        };
        Some(Curve { from: end(t_from)?, to: end(t_to)?, spoc, ends_open: false })
    }

    /// The curves of all frusta that the ray crosses (section 5.1, steps 1 and 2).
    pub fn of_graph(camera: &GraphCamera, ray: &Ray) -> Vec<Curve<'a>> {
        let pieces = camera.segment_pieces(ray.at(ray.t_from), ray.at(ray.t_to));
        let t = |share: f64| ray.t_from + (ray.t_to - ray.t_from) * share;
        let goes_on_at = |place: usize| pieces.get(place + 1).map_or(1.0, |next| next.t_from);
        let curve = |(place, piece): (usize, &::camera::SegmentPiece)| {
            let is_last = place + 1 == pieces.len();
            Some(Curve {
                from: End::new(piece.from, t(piece.t_from))?,
                to: End::new(piece.to, t(piece.t_to))?,
                spoc: None,
                ends_open: piece.t_to < goes_on_at(place) || is_last && piece.t_to < 1.0,
            })
        };
        pieces.iter().enumerate().filter_map(curve).collect()
    }

    /// The part whose image may lie inside of an image of `size_px` with depths in `w`. `None` where there is none.
    pub fn clip(&self, size_px: DVec2, w: Range) -> Option<Curve<'a>> {
        // A pushed point lies behind its straight one, as seen from the pole: if it is in the image, the straight one lies in
        // the least box around image and pole.
        let pole_px = self.spoc.map_or(size_px / 2.0, |spoc| spoc.pole_px);
        let (min_px, max_px) = (pole_px.min(DVec2::ZERO), pole_px.max(size_px));
        let (a, b) = (&self.from, &self.to);
        let limits = [
            (a.straight_px.x, b.straight_px.x, min_px.x, max_px.x),
            (a.straight_px.y, b.straight_px.y, min_px.y, max_px.y),
            (a.w, b.w, w.min, w.max),
        ];
        let (mut s_from, mut s_to) = (0.0_f64, 1.0_f64);
        for (from, to, min, max) in limits {
            let share = |value: f64| (value - from) / (to - from);
            if from == to && !(min..=max).contains(&from) {
                return None;
            }
            if from != to {
                s_from = s_from.max(share(min).min(share(max)));
                s_to = s_to.min(share(min).max(share(max)));
            }
        }
        let end = |s: f64| End { straight_px: self.straight_px(s), w: self.w(s), t: self.t(s) };
        let is_whole = s_to >= 1.0;
        (s_from <= s_to).then(|| Curve {
            from: end(s_from),
            to: if is_whole { self.to } else { end(s_to) },
            ends_open: self.ends_open && is_whole,
            ..*self
        })
    }

    fn straight_px(&self, s: f64) -> DVec2 {
        self.from.straight_px.lerp(self.to.straight_px, s)
    }

    /// Inverse depth at `s`.
    pub fn w(&self, s: f64) -> f64 {
        self.from.w + (self.to.w - self.from.w) * s
    }

    /// The ray's parameter at `s`.
    pub fn t(&self, s: f64) -> f64 {
        self.from.t + (self.to.t - self.from.t) * (s * self.to.w / self.w(s))
    }

    /// The image at `s`.
    pub fn point(&self, s: f64) -> ImagePoint {
        let px = self.straight_px(s);
        let straight = ImagePoint { u: px.x, v: px.y, w: self.w(s) };
        self.spoc.map_or(straight, |spoc| spoc.image_from_straight(straight))
    }

    /// An upper bound of the curve's speed between two places, in pixels per unit of `s`; no greater for a part of the stretch.
    ///
    /// As for [`Spoc::length_bound_px`], but with what holds on this stretch: the factor is `1 + D/max(rho, rho_0)` at the least
    /// distance `rho` from the pole, and a change of `D` moves a point by `|dD| min(1, rho/rho_0)` at the greatest.
    fn speed_bound_px(&self, s_from: f64, s_to: f64) -> f64 {
        let straight_px = self.from.straight_px.distance(self.to.straight_px);
        let Some(spoc) = self.spoc else { return straight_px };
        let (push_from_px, push_to_px) = (spoc.push_px(self.w(s_from)), spoc.push_px(self.w(s_to)));
        let (w_from, w_to) = (1.0 / spoc.push_from_m, 1.0 / spoc.push_to_m);
        let push_slope_px = spoc.push_max_px / (w_from - w_to) * (self.to.w - self.from.w).abs();
        let change_px = if push_from_px == push_to_px { 0.0 } else { push_slope_px };
        let (from_px, to_px) = (self.straight_px(s_from), self.straight_px(s_to));
        let nearest_px = distance_to_segment(spoc.pole_px, from_px, to_px);
        let furthest_px = from_px.distance(spoc.pole_px).max(to_px.distance(spoc.pole_px));
        straight_px * (1.0 + push_from_px.max(push_to_px) / nearest_px.max(spoc.ramp_px))
            + change_px * (furthest_px / spoc.ramp_px).min(1.0)
    }

    /// An upper bound of the curve's length between two places, in pixels.
    pub fn length_bound_px(&self, s_from: f64, s_to: f64) -> f64 {
        self.speed_bound_px(s_from, s_to) * (s_to - s_from)
    }

    /// A box around the curve between two places, in pixels: the least and the greatest corner.
    ///
    /// A curve of the length `l` between two points at the distance `d` lies in the ellipse around them with the half axes `l/2` and
    /// `sqrt(l^2 - d^2)/2`, and this in the box around both, grown by the latter.
    pub fn bounds_px(&self, s_from: f64, s_to: f64) -> (DVec2, DVec2) {
        let [from_px, to_px] = [s_from, s_to].map(|s| self.point(s)).map(|point| DVec2::new(point.u, point.v));
        let length_px = self.length_bound_px(s_from, s_to);
        let detour_px = (length_px.powi(2) - from_px.distance_squared(to_px)).max(0.0).sqrt() / 2.0;
        (from_px.min(to_px) - detour_px, from_px.max(to_px) + detour_px)
    }

    /// The ends of stretches between two places that are at most so long.
    pub fn stretches(&self, s_from: f64, s_to: f64, length_px: f64) -> Stretches<'_> {
        Stretches { curve: self, at: s_from, to: s_to, length_px }
    }
}

/// See [`Curve::stretches`].
pub(crate) struct Stretches<'a> {
    curve: &'a Curve<'a>,
    at: f64,
    to: f64,
    length_px: f64,
}

impl Iterator for Stretches<'_> {
    type Item = f64;

    /// As far as the speed here allows, or less, where the speed on that way does not.
    fn next(&mut self) -> Option<f64> {
        if self.at >= self.to {
            return None;
        }
        let reach = |to: f64| self.length_px / self.curve.speed_bound_px(self.at, to.min(self.to));
        let step = reach(self.at + reach(self.at)).max(f64::from(MAX_STEPS).recip());
        self.at = if step < self.to - self.at { self.at + step } else { self.to };
        Some(self.at)
    }
}

fn distance_to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (along, to_point) = (b - a, point - a);
    let share = (to_point.dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // Of a segment without length the share is missing, and either end is nearest.
    point.distance(if share.is_nan() { a } else { a + along * share })
}

#[cfg(test)]
mod tests {
    use ::camera::Bounds;
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    fn spoc(push: f64, ramp_px: f64, pole: (f64, f64)) -> Spoc {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
        let camera = Spoc::around(&bounds, DVec3::new(0.0, 1.0, 5.0), (256, 256), 1.0).expect("outside of the box");
        Spoc { push_max_px: push * camera.push_max_px, ramp_px, pole_px: DVec2::from(pole), ..camera }
    }

    /// Here the bow is wider than half of what the length's bound exceeds the chord by.
    #[test]
    fn the_box_around_a_curve_holds_its_bow() {
        let camera = spoc(2.731788, 0.1, (133.55582, 0.0));
        let ray = Ray::segment(DVec3::new(-1.95233, -0.743585, -1.557324), DVec3::new(1.871558, -0.624039, -1.321745));
        let curve = Curve::of_pinhole(&camera.pinhole, &ray, Some(&camera)).expect("before the eye");
        let (s_from, s_to) = (0.133167, 0.836377);
        let (_, max_px) = curve.bounds_px(s_from, s_to);
        for i in 0..=64 {
            let bow_px = curve.point(s_from + (s_to - s_from) * f64::from(i) / 64.0).v;
            assert!(bow_px <= max_px.y, "{bow_px}, {max_px}");
        }
    }

    #[test]
    fn a_curve_begins_and_ends_at_the_near_plane() {
        let camera = Pinhole::symmetric(::camera::Rigid::IDENTITY, (100, 100), 1.0, 0.5);
        let (before, behind) = (DVec3::new(0.2, 0.1, 3.0), DVec3::new(-0.4, 0.3, -2.0));
        for (a, b, near) in [(before, behind, 1.0), (behind, before, 0.0)] {
            let ray = Ray::segment(a, b);
            let curve = Curve::of_pinhole(&camera, &ray, None).expect("a part is before the eye");
            assert!((curve.w(near) - 2.0).abs() < 1e-12 && (ray.at(curve.t(near)).z - 0.5).abs() < 1e-12);
            let (point, image) =
                (curve.point(0.5), camera.image_from_world(ray.at(curve.t(0.5))).expect("before the eye"));
            assert!((point.u - image.u).abs() + (point.v - image.v).abs() + (point.w - image.w).abs() < 1e-9);
        }
        assert!(Curve::of_pinhole(&camera, &Ray::segment(behind, behind * 2.0), None).is_none());
    }

    fn point() -> impl Strategy<Value = DVec3> {
        let across = || -5.0..5.0_f64;
        (across(), across(), -2.0..2.0_f64).prop_map(DVec3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2048, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_stretch_is_longer_than_its_bound(
            push in 0.0..3.0_f64,
            ramp_px in 0.1..100.0_f64,
            pole in (-50.0..300.0_f64, -50.0..300.0_f64),
            a in point(),
            b in point(),
            part in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let camera = spoc(push, ramp_px, pole);
            let curve = Curve::of_pinhole(&camera.pinhole, &Ray::segment(a, b), Some(&camera)).expect("before the eye");
            let (s_from, s_to) = (part.0.min(part.1), part.0.max(part.1));
            let px = |i: u32| {
                let at = curve.point(s_from + (s_to - s_from) * f64::from(i) / 512.0);
                DVec2::new(at.u, at.v)
            };
            let length_px: f64 = (0..512).map(|i| px(i).distance(px(i + 1))).sum();
            let bound_px = curve.length_bound_px(s_from, s_to);
            prop_assert!(length_px <= bound_px * (1.0 + 1e-9) + 1e-9, "{length_px} > {bound_px}");
            let (min_px, max_px) = curve.bounds_px(s_from, s_to);
            for i in 0..=512 {
                prop_assert!(px(i).cmpge(min_px - 1e-9).all() && px(i).cmple(max_px + 1e-9).all(), "{} leaves", px(i));
            }
            let mut from = s_from;
            for to in curve.stretches(s_from, s_to, 3.0) {
                prop_assert!(curve.length_bound_px(from, to) <= 3.0 * (1.0 + 1e-9) || to - from <= 1.0 / f64::from(MAX_STEPS));
                from = to;
            }
            prop_assert_eq!(from, s_to);
        }

        #[test]
        fn a_curve_is_the_image_of_its_ray_and_clipping_keeps_what_is_inside(
            push in 0.0..3.0_f64,
            pole in (-50.0..300.0_f64, -50.0..300.0_f64),
            a in point(),
            b in point(),
            s in 0.0..1.0_f64,
        ) {
            let camera = spoc(push, 20.0, pole);
            let ray = Ray::segment(a, b);
            let curve = Curve::of_pinhole(&camera.pinhole, &ray, Some(&camera)).expect("before the eye");
            let (point, image) = (curve.point(s), camera.image_from_world(ray.at(curve.t(s))).expect("before the eye"));
            prop_assert!((point.u - image.u).abs() + (point.v - image.v).abs() < 1e-6, "{point:?} {image:?}");
            prop_assert!((point.w - image.w).abs() < 1e-9);
            let depths = Range { min: 0.18, max: 0.22 };
            let is_inside = (0.0..256.0).contains(&point.u) && (0.0..256.0).contains(&point.v);
            if is_inside && depths.meets(Range { min: point.w, max: point.w }) {
                let clipped = curve.clip(DVec2::splat(256.0), depths).expect("a point inside");
                let t = curve.t(s);
                prop_assert!(clipped.t(0.0) <= t + 1e-9 && t <= clipped.t(1.0) + 1e-9);
            }
        }
    }
}
