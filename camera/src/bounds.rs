use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::ImagePoint;

/// A box along the axes of world space, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// The corner with the least coordinates.
    pub min: DVec3,
    /// The corner with the greatest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The least box around points, or `None` around none.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Option<Bounds> {
        points.into_iter().map(|point| Bounds { min: point, max: point }).reduce(Bounds::union)
    }

    /// The least box around two.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box's middle.
    pub fn middle(&self) -> DVec3 {
        self.min.midpoint(self.max)
    }

    /// Its eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        let high = |index: usize| glam::BVec3::new(index & 1 != 0, index & 2 != 0, index & 4 != 0);
        std::array::from_fn(|index| DVec3::select(high(index), self.max, self.min))
    }

    /// The length of the longest side in metres.
    pub fn extent_m(&self) -> f64 {
        (self.max - self.min).max_element()
    }

    /// Whether two boxes, the other one grown by `slack_m` on every side, have a point in common.
    pub fn meets(&self, other: &Bounds, slack_m: f64) -> bool {
        (self.min - slack_m).cmple(other.max).all() && (self.max + slack_m).cmpge(other.min).all()
    }
}

/// A part of an image, and the inverse depths in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageBounds {
    /// The corner nearest to the image's origin, in pixels.
    pub min_px: DVec2,
    /// The corner across, in pixels.
    pub max_px: DVec2,
    /// The least inverse depth, in the camera's own measure.
    pub w_min: f64,
    /// The greatest inverse depth.
    pub w_max: f64,
}

impl ImageBounds {
    /// The least bounds around image points, or `None` around none.
    pub fn around(points: impl IntoIterator<Item = ImagePoint>) -> Option<ImageBounds> {
        let at = |point: ImagePoint| {
            let px = DVec2::new(point.u, point.v);
            ImageBounds { min_px: px, max_px: px, w_min: point.w, w_max: point.w }
        };
        points.into_iter().map(at).reduce(ImageBounds::union)
    }

    /// The least bounds around two.
    pub fn union(self, other: ImageBounds) -> ImageBounds {
        ImageBounds {
            min_px: self.min_px.min(other.min_px),
            max_px: self.max_px.max(other.max_px),
            w_min: self.w_min.min(other.w_min),
            w_max: self.w_max.max(other.w_max),
        }
    }
}
