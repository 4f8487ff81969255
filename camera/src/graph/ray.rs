use glam::DVec3;

use super::{Frustum, FrustumId, GraphCamera};
use crate::convex::depth_m;
use crate::{Bounds, HalfSpace, ImagePoint};

/// The straight part of a camera ray within one frustum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayPiece {
    /// Which frustum.
    pub frustum: FrustumId,
    /// Where it comes in, in world space.
    pub from_world: DVec3,
    /// Where it leaves.
    pub to_world: DVec3,
    /// Inverse depth where it comes in.
    pub w_from: f64,
    /// Inverse depth where it leaves; less than `w_from`, and exactly the next piece's `w_from`.
    pub w_to: f64,
}

/// The part of a world segment within one frustum. It projects to a straight line, along which `w` is linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentPiece {
    /// Which frustum.
    pub frustum: FrustumId,
    /// Where it begins, as a share of the whole segment: 0 to 1.
    pub t_from: f64,
    /// Where it ends; greater than `t_from`.
    pub t_to: f64,
    /// The image of its beginning.
    pub from: ImagePoint,
    /// The image of its end.
    pub to: ImagePoint,
}

impl GraphCamera {
    /// All points that land at `(u, v)` pixels, near to far: one piece in each frustum on the way. Empty where the root has no
    /// ray: outside of the image, or not finite.
    pub fn ray(&self, u: f64, v: f64) -> Vec<RayPiece> {
        let mut pieces = Vec::new();
        let (mut id, mut z_from) = (FrustumId::ROOT, self.root().near_m);
        loop {
            let frustum = &self.frusta[id.place()];
            let ray_world = frustum.ray_world(u, v);
            let at = |z: f64| frustum.centre_world + ray_world * z;
            let (sides, limits) = frustum.sides_and_limits();
            if pieces.is_empty() && !self.is_deep(depth_m(sides, at(z_from)), at(z_from)) {
                return pieces;
            }
            let leaves = |limit: &HalfSpace| {
                let speed = limit.outward.dot(ray_world);
                (speed > 0.0).then(|| limit.depth_m(frustum.centre_world) / speed)
            };
            let z_to = limits.iter().filter_map(leaves).fold(f64::INFINITY, f64::min);
            // Compared as `w`: two depths that differ by a rounding may have one `w`.
            let (w_from, w_to) = (1.0 / z_from, 1.0 / z_to);
            if !(w_to < w_from && z_to.is_finite()) {
                return pieces;
            }
            let (from_world, to_world) = (at(z_from), at(z_to));
            pieces.push(RayPiece { frustum: id, from_world, to_world, w_from, w_to });
            let Some(child) = self.child_at(frustum, to_world) else { return pieces };
            (id, z_from) = (child, z_to);
        }
    }

    /// The parts of the world segment from `a` to `b` within frusta, from `a` on: the papers' second algorithm, section 5.1,
    /// walks each along a line of the image. A segment within a face between frusta may belong to either or to none.
    pub fn segment_pieces(&self, a_world: DVec3, b_world: DVec3) -> Vec<SegmentPiece> {
        let bounds = Bounds { min: a_world.min(b_world), max: a_world.max(b_world) };
        let piece = |id: FrustumId| {
            let frustum = &self.frusta[id.place()];
            let (t_from, t_to) = frustum.clip_segment(a_world, b_world)?;
            let image = |t: f64| frustum.image_from_world(a_world.lerp(b_world, t));
            Some(SegmentPiece { frustum: id, t_from, t_to, from: image(t_from)?, to: image(t_to)? })
        };
        let mut pieces: Vec<SegmentPiece> = self.index.meeting(bounds, 0.0).filter_map(piece).collect();
        pieces.sort_by(|a, b| a.t_from.total_cmp(&b.t_from));
        pieces
    }

    /// The child whose face holds a point where a ray leaves.
    fn child_at(&self, frustum: &Frustum, p_world: DVec3) -> Option<FrustumId> {
        let depth_in_face = |child: &FrustumId| {
            let child = &self.frusta[child.place()];
            depth_m(child.sides_and_limits().0, p_world).min(-child.half_spaces[0].depth_m(p_world).abs())
        };
        let deepest =
            frustum.children.iter().map(|child| (*child, depth_in_face(child))).max_by(|a, b| a.1.total_cmp(&b.1));
        deepest.filter(|(_, depth_m)| self.is_deep(*depth_m, p_world)).map(|(child, _)| child)
    }

    /// Whether a depth counts as inside, for a point that is rounded.
    fn is_deep(&self, depth_m: f64, p_world: DVec3) -> bool {
        depth_m >= -self.rounding_m(p_world)
    }
}

impl Frustum {
    /// The stretch of a segment within the frustum, as shares of its length, or `None` where there is none.
    fn clip_segment(&self, a_world: DVec3, b_world: DVec3) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for half_space in &self.half_spaces {
            let (depth_a, depth_b) = (half_space.depth_m(a_world), half_space.depth_m(b_world));
            match (depth_a < 0.0, depth_b < 0.0) {
                (true, true) => return None,
                (true, false) => from = from.max(depth_a / (depth_a - depth_b)),
                (false, true) => to = to.min(depth_a / (depth_a - depth_b)),
                (false, false) => {}
            }
        }
        (from < to).then_some((from, to))
    }
}
