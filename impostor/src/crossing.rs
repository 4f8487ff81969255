//! One step of a walk: does the ray cross the surface between two of its points?

use ::camera::ImagePoint;
use glam::DVec2;

use crate::image::{Impostor, TexelId};

/// Which side of a surface a ray meets, as the impostor's camera sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The ray comes from where the camera looks from.
    Front,
    /// It comes out from behind. What it met on the way in, if the surface is closed, this image does not show. Out of a wall
    /// where a graph camera's frusta end, rounding decides whether it counts as met: the wall is where the ray's piece begins.
    Back,
}

/// A point of a ray's projection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Probe {
    pub point: ImagePoint,
    /// The ray's parameter.
    pub t: f64,
}

/// Where a ray meets the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    pub t: f64,
    pub point: ImagePoint,
    pub texel: TexelId,
    pub side: Side,
}

/// From one probe to the next: straight in the image, with `w` linear in it.
struct Step {
    from: Probe,
    to: Probe,
}

impl Step {
    /// The image at a share of the way.
    fn point(&self, share: f64) -> ImagePoint {
        let lerp = |a: f64, b: f64| a + (b - a) * share;
        let (a, b) = (&self.from.point, &self.to.point);
        ImagePoint { u: lerp(a.u, b.u), v: lerp(a.v, b.v), w: lerp(a.w, b.w) }
    }

    /// Where it crosses borders between pixels, as shares of the way, in order: at most one along each axis, as a step is at
    /// most a pixel long; 1 where it crosses none.
    fn borders(&self) -> [f64; 2] {
        let along = |from: f64, to: f64| {
            let border = from.floor().max(to.floor());
            if from.floor() == to.floor() { 1.0 } else { (border - from) / (to - from) }
        };
        let (a, b) = (&self.from.point, &self.to.point);
        let (across, down) = (along(a.u, b.u), along(a.v, b.v));
        [across.min(down), across.max(down)]
    }

    /// What is met at a share of the way by a ray that was `ahead_w` before it.
    fn crossing(&self, share: f64, texel: TexelId, ahead_w: f64) -> Crossing {
        let point = self.point(share);
        let t = self.from.t + (self.to.t - self.from.t) * (share * self.to.point.w / point.w);
        Crossing { t, point, texel, side: if ahead_w > 0.0 { Side::Front } else { Side::Back } }
    }
}

impl Impostor {
    /// The first crossing on the way from one point to the next, at most a pixel further: through the plane of a pixel, within
    /// that pixel; or, on the border of two that show one surface, between their planes.
    pub(crate) fn crossing(&self, from: Probe, to: Probe) -> Option<Crossing> {
        let step = Step { from, to };
        let [first, second] = step.borders();
        let mut before = None;
        for (enters, leaves) in [(0.0, first), (first, second), (second, 1.0)] {
            let texel = self.texel_at_point(&step.point((enters + leaves) / 2.0));
            let crossing = self
                .crossing_between(&step, before, texel, enters)
                .or_else(|| self.crossing_within(&step, texel?, enters, leaves));
            if crossing.is_some() || leaves >= 1.0 {
                return crossing;
            }
            before = texel;
        }
        None
    }

    fn crossing_between(
        &self,
        step: &Step,
        before: Option<TexelId>,
        behind: Option<TexelId>,
        border: f64,
    ) -> Option<Crossing> {
        let (before, behind, point) = (before?, behind?, step.point(border));
        let ahead_w = self.ahead_w(before, point);
        let changes_side = (ahead_w > 0.0) != (self.ahead_w(behind, point) > 0.0);
        (changes_side && self.is_one_surface(before, behind)).then(|| step.crossing(border, behind, ahead_w))
    }

    fn crossing_within(&self, step: &Step, texel: TexelId, enters: f64, leaves: f64) -> Option<Crossing> {
        let ahead_w = self.ahead_w(texel, step.point(enters));
        let ahead_later_w = self.ahead_w(texel, step.point(leaves));
        let share = || enters + (leaves - enters) * (ahead_w / (ahead_w - ahead_later_w));
        ((ahead_w > 0.0) != (ahead_later_w > 0.0)).then(|| step.crossing(share(), texel, ahead_w))
    }

    /// The wall where a camera's frusta end often *is* what it shows there, and rounding may put the sample behind: the end of
    /// such a ray counts as met where the ray is before the surface, and within what the pixel spans in depth.
    pub(crate) fn crossing_at_open_end(&self, end: Probe) -> Option<Crossing> {
        let texel = self.texel_at_point(&end.point)?;
        let is_met = self.ahead_w(texel, end.point) > 0.0 && end.point.w <= self.range(texel).max;
        is_met.then_some(Crossing { t: end.t, point: end.point, texel, side: Side::Front })
    }

    fn texel_at_point(&self, point: &ImagePoint) -> Option<TexelId> {
        self.texel_at(DVec2::new(point.u, point.v))
    }
}
