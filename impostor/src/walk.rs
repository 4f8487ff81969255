//! The walks along a ray's projection.

use crate::crossing::{Crossing, Probe};
use crate::curve::{Curve, MAX_HALVINGS, MAX_STEPS, curves};
use crate::image::Impostor;
use crate::pyramid::Range;
use crate::ray::Ray;

/// How to walk along a ray's projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The papers' generic algorithm (section 3.2), for a graph camera their first one: points spaced evenly along the ray in
    /// space, each projected by itself, as many as the length of the projection has fine steps. Between points that have no
    /// image nothing is found, and where the projection is fast, pixels are leapt over.
    Points,
    /// Fine steps all the way, along the projection; for a graph camera the papers' second algorithm (section 5.1).
    Fine,
    /// Stretches of this length in pixels; those which something in the pixels around meets in depth are walked in fine steps
    /// (section 7.2).
    Coarse {
        /// The papers take 3 to 12 pixels, and measure with 6.
        coarse_px: f64,
    },
    /// The whole projection first, halved where something meets it, down to fine steps; what meets nothing is left out,
    /// and the next stretch is as long as halving allows.
    Hierarchy,
}

/// What an intersection cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StepCount {
    /// Projections walked along: 1, or one for each frustum of a graph camera that the ray crosses.
    pub curves: u32,
    /// Stretches that were compared with the pixels around them.
    pub coarse: u32,
    /// Steps from point to point.
    pub fine: u32,
}

impl StepCount {
    /// Coarse and fine steps, as the papers count them.
    pub fn steps(&self) -> u32 {
        self.coarse + self.fine
    }
}

/// A search under way.
pub(crate) struct Walk<'a> {
    impostor: &'a Impostor,
    fine_px: f64,
    count: StepCount,
}

impl<'a> Walk<'a> {
    pub fn new(impostor: &'a Impostor, fine_px: f64) -> Walk<'a> {
        // Chosen: 256 steps a pixel; 0 would be no length. No step is shorter than 1 / `MAX_STEPS` of its curve, so that a curve of more than 256 px is not walked more finely
        // whatever this is.
        Walk { impostor, fine_px: 1.0_f64.min(fine_px).max(1.0 / 256.0), count: StepCount::default() }
    }

    /// What it has cost so far.
    pub fn count(&self) -> StepCount {
        self.count
    }

    pub fn first_crossing(&mut self, ray: &Ray, method: Method) -> Option<Crossing> {
        let impostor = self.impostor;
        let within = |curve: Curve<'a>| curve.clip(impostor.size_px(), impostor.pyramid().whole());
        let curves: Vec<_> = curves(impostor.camera(), ray).into_iter().filter_map(within).collect();
        self.count.curves = curves.len() as u32;
        if method == Method::Points {
            return self.points(ray, &curves);
        }
        curves.iter().find_map(|curve| {
            let crossing = match method {
                Method::Points | Method::Fine => self.fine(curve, 0.0, 1.0),
                Method::Coarse { coarse_px } => self.coarse(curve, coarse_px.max(self.fine_px)),
                Method::Hierarchy => self.hierarchy(curve),
            };
            crossing.or_else(|| self.open_end(curve))
        })
    }

    /// From the first curve's beginning to the last one's end, evenly in space.
    fn points(&mut self, ray: &Ray, curves: &[Curve<'_>]) -> Option<Crossing> {
        let impostor = self.impostor;
        let (t_from, t_to) = (curves.first()?.t(0.0), curves.last()?.t(1.0));
        let length_px: f64 = curves.iter().map(|curve| curve.length_bound_px(0.0, 1.0)).sum();
        let steps = (length_px / self.fine_px).ceil().clamp(1.0, MAX_STEPS.into()) as u32;
        let probe = |step: u32| {
            let t = t_from + (t_to - t_from) * f64::from(step) / f64::from(steps);
            impostor.camera().image_from_world(ray.at(t)).map(|point| Probe { point, t })
        };
        let mut from = probe(0);
        for step in 1..=steps {
            self.count.fine += 1;
            let to = probe(step);
            let crossing = match (from, to) {
                (Some(from), Some(to)) => impostor.crossing(from, to),
                (Some(from), None) => impostor.crossing_at_open_end(from),
                (None, _) => None,
            };
            if crossing.is_some() {
                return crossing;
            }
            from = to;
        }
        from.filter(|_| curves.last().is_some_and(|last| last.ends_open))
            .and_then(|end| impostor.crossing_at_open_end(end))
    }

    /// In fine steps over a part of a curve.
    fn fine(&mut self, curve: &Curve<'_>, s_from: f64, s_to: f64) -> Option<Crossing> {
        let mut from = probe(curve, s_from);
        for s in curve.stretches(s_from, s_to, self.fine_px) {
            let to = probe(curve, s);
            self.count.fine += 1;
            if let Some(crossing) = self.impostor.crossing(from, to) {
                return Some(crossing);
            }
            from = to;
        }
        None
    }

    fn coarse(&mut self, curve: &Curve<'_>, coarse_px: f64) -> Option<Crossing> {
        let mut s_from = 0.0;
        for s_to in curve.stretches(0.0, 1.0, coarse_px) {
            let crossing = self.may_cross(curve, s_from, s_to).then(|| self.fine(curve, s_from, s_to)).flatten();
            if crossing.is_some() {
                return crossing;
            }
            s_from = s_to;
        }
        None
    }

    /// Stretches are `2^level` of [`MAX_STEPS`] equal parts of `s`. Where one is left out, or walked to its end, the next one
    /// begins; it is twice as long if it can be, so that a walk through nothing takes few stretches.
    fn hierarchy(&mut self, curve: &Curve<'_>) -> Option<Crossing> {
        let (mut at, mut level) = (0, MAX_HALVINGS);
        while at < MAX_STEPS {
            let s = |part: u32| f64::from(part) / f64::from(MAX_STEPS);
            let (s_from, s_to) = (s(at), s(at + (1 << level)));
            let is_fine = level == 0 || curve.length_bound_px(s_from, s_to) <= self.fine_px;
            if is_fine {
                self.count.fine += 1;
                let (from, to) = (probe(curve, s_from), probe(curve, s_to));
                if let Some(crossing) = self.impostor.crossing(from, to) {
                    return Some(crossing);
                }
            } else if self.may_cross(curve, s_from, s_to) {
                level -= 1;
                continue;
            }
            at += 1 << level;
            level = (level + 1).min(at.trailing_zeros());
        }
        None
    }

    fn open_end(&self, curve: &Curve<'_>) -> Option<Crossing> {
        curve.ends_open.then(|| self.impostor.crossing_at_open_end(probe(curve, 1.0))).flatten()
    }

    /// Whether a surface in the pixels around a stretch of the curve meets its depths. Where none does, nothing crosses it.
    fn may_cross(&mut self, curve: &Curve<'_>, s_from: f64, s_to: f64) -> bool {
        self.count.coarse += 1;
        let (min_px, max_px) = curve.bounds_px(s_from, s_to);
        let (from, to) = (curve.w(s_from), curve.w(s_to));
        self.impostor.pyramid().over(min_px, max_px).meets(Range { min: from.min(to), max: from.max(to) })
    }
}

fn probe(curve: &Curve<'_>, s: f64) -> Probe {
    Probe { point: curve.point(s), t: curve.t(s) }
}
