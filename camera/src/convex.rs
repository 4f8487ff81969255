//! Convex bodies as sets of planes, and convex polygons: what camera frusta are made of.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::Bounds;

/// The points on one side of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point on the plane, in world space.
    pub point: DVec3,
    /// Points out of the half-space. Of any length where people write it, a unit vector wherever a camera gives it.
    pub outward: DVec3,
}

impl HalfSpace {
    /// How far inside of the plane a point lies, in units of the length of `outward`; negative outside.
    pub fn depth_m(&self, p_world: DVec3) -> f64 {
        self.outward.dot(self.point - p_world)
    }

    /// What lies on the other side. Depths are exactly the negatives, so that two bodies which share a face leave no gap.
    pub fn opposite(&self) -> HalfSpace {
        HalfSpace { point: self.point, outward: -self.outward }
    }

    /// The same with a unit vector, or `None` where a number is not finite or the direction has no length.
    pub(crate) fn normalized(&self) -> Option<HalfSpace> {
        let outward = self.outward.try_normalize()?;
        self.point.is_finite().then_some(HalfSpace { point: self.point, outward })
    }
}

impl Bounds {
    /// The box as the points inside of six planes.
    pub fn half_spaces(&self) -> [HalfSpace; 6] {
        let below = |outward| HalfSpace { point: self.min, outward };
        let above = |outward| HalfSpace { point: self.max, outward };
        [
            below(DVec3::NEG_X),
            below(DVec3::NEG_Y),
            below(DVec3::NEG_Z),
            above(DVec3::X),
            above(DVec3::Y),
            above(DVec3::Z),
        ]
    }
}

/// How thin a body or a face may be against its extent before it counts as flat, and how exactly faces must meet: what
/// text of six digits can state.
pub(crate) const TOLERANCE: f64 = 1e-6;

/// The least depth of a point in half-spaces: how deep it lies in the body that they have in common.
pub(crate) fn depth_m(half_spaces: &[HalfSpace], p_world: DVec3) -> f64 {
    half_spaces.iter().map(|half_space| half_space.depth_m(p_world)).fold(f64::INFINITY, f64::min)
}

/// The corners of the body that half-spaces with unit vectors have in common, in world space. Every three planes are tried;
/// a corner where more of them meet comes several times.
pub(crate) fn corners(half_spaces: &[HalfSpace]) -> Vec<DVec3> {
    /// Three planes with a smaller determinant are taken as parallel: a corner there is rounded by a thousandth of its
    /// distance and more, and with the next plane around the same body they make it again.
    const PARALLEL: f64 = 1e-13;
    /// How far outside a corner may lie because of rounding, against its distance: a determinant of 1e-6 at full precision.
    const ROUNDING: f64 = 1e-9;
    let Some(origin) = half_spaces.first().map(|first| first.point) else { return Vec::new() };
    let from_origin: Vec<f64> = half_spaces.iter().map(|plane| plane.depth_m(origin)).collect();
    let size_m = half_spaces.iter().map(|plane| plane.point.distance(origin)).fold(0.0, f64::max);
    let mut found = Vec::new();
    for (i, a) in half_spaces.iter().enumerate() {
        for (j, b) in half_spaces.iter().enumerate().skip(i + 1) {
            let a_b = a.outward.cross(b.outward);
            for (k, c) in half_spaces.iter().enumerate().skip(j + 1) {
                let determinant = a_b.dot(c.outward);
                if determinant.abs() < PARALLEL {
                    continue;
                }
                let (b_c, c_a) = (b.outward.cross(c.outward), c.outward.cross(a.outward));
                let offset = (b_c * from_origin[i] + c_a * from_origin[j] + a_b * from_origin[k]) / determinant;
                let slack_m = ROUNDING * size_m.max(offset.length());
                // Relative to the origin: far out, coordinates are rounded more coarsely than a small body can stand.
                let depth_m = |(plane, from_m): (&HalfSpace, &f64)| from_m - plane.outward.dot(offset);
                if half_spaces.iter().zip(&from_origin).map(depth_m).all(|depth_m| depth_m >= -slack_m) {
                    found.push(origin + offset);
                }
            }
        }
    }
    found
}

/// Whether the body of half-spaces, given its corners, has a volume: their mean lies deeper inside than [`TOLERANCE`] of its
/// extent.
pub(crate) fn has_volume(half_spaces: &[HalfSpace], corners: &[DVec3]) -> bool {
    let Some(bounds) = Bounds::around(corners.iter().copied()) else { return false };
    let mean = bounds.min + corners.iter().map(|corner| corner - bounds.min).sum::<DVec3>() / corners.len() as f64;
    depth_m(half_spaces, mean) > TOLERANCE * bounds.extent_m()
}

/// The part of a convex polygon inside of a half-space.
pub(crate) fn clip(polygon: &[DVec3], half_space: &HalfSpace) -> Vec<DVec3> {
    let mut clipped = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in edges(polygon) {
        let (depth_a, depth_b) = (half_space.depth_m(a), half_space.depth_m(b));
        if depth_a >= 0.0 {
            clipped.push(a);
        }
        if (depth_a < 0.0) != (depth_b < 0.0) {
            clipped.push(a + (b - a) * (depth_a / (depth_a - depth_b)));
        }
    }
    clipped
}

/// A polygon's edges, from corner to corner and back to the first.
pub(crate) fn edges(polygon: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> {
    polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1))
}

/// Half the sum of the cross products of a plane polygon: along its normal, as long as its area is large.
pub(crate) fn area_m2(polygon: &[DVec3]) -> DVec3 {
    let Some(&first) = polygon.first() else { return DVec3::ZERO };
    edges(polygon).map(|(a, b)| (a - first).cross(b - first)).sum::<DVec3>() / 2.0
}

/// The polygon without corners that lie on the one before within `slack_m`: an edge must have a direction.
pub(crate) fn without_short_edges(polygon: &[DVec3], slack_m: f64) -> Vec<DVec3> {
    edges(polygon).filter(|(a, b)| a.distance(*b) > slack_m).map(|(a, _)| a).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_eight_corners_and_a_cut_one_ten() {
        let bounds = Bounds { min: DVec3::new(1e7, -2.0, 0.5), max: DVec3::new(1e7 + 1.0, 3.0, 0.75) };
        let mut planes = bounds.half_spaces().to_vec();
        let eight = corners(&planes);
        assert_eq!((eight.len(), Bounds::around(eight.iter().copied())), (8, Some(bounds)));
        assert!(has_volume(&planes, &eight));
        let outward = DVec3::new(1.0, 1.0, 1.0).normalize();
        planes.push(HalfSpace { point: bounds.max - DVec3::splat(0.05), outward });
        assert_eq!(corners(&planes).len(), 10);
        planes.push(HalfSpace { point: bounds.min, outward: DVec3::X });
        assert!(!has_volume(&planes, &corners(&planes)), "a face alone");
    }

    #[test]
    fn clipping_a_square_halves_it() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let half = clip(&square, &HalfSpace { point: DVec3::new(0.5, 0.0, 0.0), outward: DVec3::X });
        assert_eq!(area_m2(&half), DVec3::Z / 2.0);
        assert!(clip(&square, &HalfSpace { point: -DVec3::X, outward: DVec3::X }).is_empty());
    }
}
