use ::camera::Bounds;
use glam::DVec3;

/// A stretch of a straight line in world space: the points `origin + t direction` with `t_from <= t <= t_to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where `t` is 0.
    pub origin_world: DVec3,
    /// Of any length but zero; `t` counts in it.
    pub direction_world: DVec3,
    /// Where the ray begins. A ray that leaves a surface begins off it, or it meets the samples of that surface.
    pub t_from: f64,
    /// Where it ends; may be infinite.
    pub t_to: f64,
}

impl Ray {
    /// From a point on, without end.
    pub fn endless(origin_world: DVec3, direction_world: DVec3) -> Ray {
        Ray { origin_world, direction_world, t_from: 0.0, t_to: f64::INFINITY }
    }

    /// From a point, where `t` is 0, to another one, where it is 1.
    pub fn segment(from_world: DVec3, to_world: DVec3) -> Ray {
        Ray { origin_world: from_world, direction_world: to_world - from_world, t_from: 0.0, t_to: 1.0 }
    }

    /// The point at `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin_world + self.direction_world * t
    }

    /// The part within a box; `None` where there is none, or where a number is missing.
    pub(crate) fn clip(&self, bounds: &Bounds) -> Option<Ray> {
        let is_line = self.origin_world.is_finite() && self.direction_world.is_finite();
        if !is_line || self.t_from.is_nan() || self.t_to.is_nan() {
            return None;
        }
        let (mut t_from, mut t_to) = (self.t_from, self.t_to);
        for axis in 0..3 {
            let (origin, speed) = (self.origin_world[axis], self.direction_world[axis]);
            let (min, max) = (bounds.min[axis], bounds.max[axis]);
            if speed != 0.0 {
                let (a, b) = ((min - origin) / speed, (max - origin) / speed);
                t_from = t_from.max(a.min(b));
                t_to = t_to.min(a.max(b));
            } else if !(min..=max).contains(&origin) {
                return None;
            }
        }
        let is_there = t_from <= t_to && self.at(t_from).is_finite() && self.at(t_to).is_finite();
        is_there.then_some(Ray { t_from, t_to, ..*self })
    }
}
