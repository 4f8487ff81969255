//! The graph camera: one image of a whole scene, whose rays go round corners.
//!
//! Method: Popescu, Rosen, Adamo-Villani, *The Graph Camera*; as used by Rosen, Popescu, Hayward, Wyman, *Non-pinhole
//! approximations for interactive rendering*, section 5, and *Non-pinhole impostors* (2009), section 5. A pinhole's frustum is
//! bent, split and merged into a graph of frusta, each a pinhole's of its own. A ray is straight within a frustum, and goes on
//! continuously, in another direction, where it crosses the face to the next.
//!
//! | papers | here |
//! |---|---|
//! | frustum | [`Frustum`] |
//! | bend, split, merge | faces in a [`GraphDescription`] |
//! | the matrix that concatenates the projections up to the root | `H` below; [`Frustum::clip_from_offset`] for the GPU |
//! | octree to find the frustum of a point | a tree of boxes; [`GraphCamera::frustum_of`] |
//! | ray intersection, section 5.1, step 1 and 2 | [`GraphCamera::segment_pieces`] |
//!
//! **Projection.** A point `X` of the frustum with the centre `c` has the image `(u, v, 1)/w = H (X - c)`. The papers multiply
//! the projections of all frusta up to the root, which loses precision with every factor and has a depth of its own in every
//! frustum. Here `H_child = H_parent (I + (c_child - c_parent) n^T/delta)` with `n` the normal of the face between them and
//! `delta = n.(p - c_child) > 0` for its points `p`. On the face, `n.(X - c_child) = delta`, so both frusta give the same `H (X - c)`,
//! not only up to a factor: image *and* `w` are continuous.
//!
//! **Depth.** `1/w` is the third component of `H (X - c)`. Along a ray within a frustum, `X - c = (1/w) H^-1 (u, v, 1)`, so `1/w` grows
//! with the distance from `c`; being positive on the root's near plane and continuous across faces, it is positive everywhere,
//! and `w` falls along the whole bent ray: one depth test serves all frusta. Along a straight segment within a frustum `w` is
//! linear in the image, as for a pinhole.
//!
//! **One-to-one.** Frusta have no points in common, which is checked, so a point has one frustum and one image. Where rays leave a
//! frustum, at most one child goes on, or two would overlap behind their faces; so a ray is one path down the tree, and
//! `(u, v, w)` is one point of it. Points outside of all frusta, as in the gap of a split, have no image.
//!
//! **Resolution.** Behind a face, only what its image spans is left: a corridor with a few bends ends in a few pixels, long before
//! rounding matters. [`GraphDescription::min_face_px`] cuts chains there.

mod build;
mod compose;
mod description;
mod frustum;
mod id;
mod index;
mod ray;

pub use build::{CorridorMap, CorridorMapError, FloorGrid, Heading, Storey, split_behind};
pub use description::{FaceDescription, FrustumDescription, GraphDescription, GraphError, RootDescription};
pub use frustum::{ClipFromOffset, Frustum};
pub use id::FrustumId;
pub use ray::{RayPiece, SegmentPiece};

use glam::DVec3;
use index::Index;
use serde::{Deserialize, Serialize};

use crate::convex::{corners, depth_m};
use crate::{Bounds, ImageBounds, ImagePoint, Pinhole};

/// A tree of pinhole frusta with one image. See the module's words. It is made of a [`GraphDescription`], which is what to
/// store and send.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "GraphDescription", into = "GraphDescription")]
pub struct GraphCamera {
    description: GraphDescription,
    frusta: Vec<Frustum>,
    index: Index,
    /// The greatest coordinate of a corner or centre, in metres: what rounding goes by.
    size_m: f64,
}

impl GraphCamera {
    /// The most frusta of one camera.
    pub const MAX_FRUSTA: usize = FrustumId::COUNT;

    /// The most limits, faces, and corners of a face, of one frustum.
    pub const MAX_PLANES: usize = 16;

    fn new(description: GraphDescription, frusta: Vec<Frustum>, index: Index) -> GraphCamera {
        let points = frusta.iter().flat_map(|frustum| frustum.corners.iter().chain([&frustum.centre_world]));
        let size_m = points.map(|point| point.abs().max_element()).fold(0.0, f64::max);
        GraphCamera { description, frusta, index, size_m }
    }

    /// Image width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.root().width_px, self.root().height_px)
    }

    /// What it is made of: as it was given, less what [`GraphDescription::min_face_px`] leaves out.
    pub fn description(&self) -> &GraphDescription {
        &self.description
    }

    /// The pinhole whose image this is, and whose frustum is the first.
    pub fn root(&self) -> &Pinhole {
        &self.description.root.pinhole
    }

    /// All frusta, parents before children, in the places of their ids.
    pub fn frusta(&self) -> &[Frustum] {
        &self.frusta
    }

    /// One frustum, or `None` for an id of another camera.
    pub fn frustum(&self, id: FrustumId) -> Option<&Frustum> {
        self.frusta.get(id.place())
    }

    /// The box around all frusta: a ray that misses it meets nothing.
    pub fn bounds_world(&self) -> Bounds {
        self.index.bounds()
    }

    /// The frustum that holds a point; on a face between two, either. `None` outside of all, or where a coordinate is not
    /// finite.
    pub fn frustum_of(&self, p_world: DVec3) -> Option<FrustumId> {
        let slack_m = self.rounding_m(p_world);
        let depth = |id: FrustumId| depth_m(&self.frusta[id.place()].half_spaces, p_world);
        let deepest = self.index.holding(p_world, slack_m).map(|id| (id, depth(id))).max_by(|a, b| a.1.total_cmp(&b.1));
        deepest.filter(|(_, depth_m)| *depth_m >= -slack_m).map(|(id, _)| id)
    }

    /// Where a world point lands, and in which frustum it lies; `None` outside of all frusta, or where a coordinate is not
    /// finite.
    pub fn image_from_world(&self, p_world: DVec3) -> Option<(ImagePoint, FrustumId)> {
        let id = self.frustum_of(p_world)?;
        Some((self.frusta[id.place()].image_from_world(p_world)?, id))
    }

    /// The world point of an image point that is known to lie in a frustum. `None` where `w` is not positive, a number is not
    /// finite, or there is no such frustum.
    pub fn world_from_image(&self, point: ImagePoint, frustum: FrustumId) -> Option<DVec3> {
        let world = self.frustum(frustum)?.world_from_image(point);
        (point.w > 0.0 && world.is_finite()).then_some(world)
    }

    /// The frustum of an image point: where its ray is at `w`. Before the ray's beginning that is the root, beyond its end the
    /// last frustum it comes to, as what a camera shows often *is* the wall where frusta end, and rounding may put it
    /// behind. `None` where no ray begins, or a number is not finite.
    ///
    /// It walks down the tree; where many points are unprojected, keep the frustum beside each.
    pub fn frustum_at(&self, point: ImagePoint) -> Option<FrustumId> {
        let pieces = self.ray(point.u, point.v);
        let at = pieces.iter().find(|piece| point.w >= piece.w_to);
        at.or(pieces.last()).filter(|_| point.w.is_finite()).map(|piece| piece.frustum)
    }

    /// Bounds of the image of what lies within a box; `None` where no frustum meets it.
    pub fn image_bounds(&self, bounds: &Bounds) -> Option<ImageBounds> {
        let in_frustum = |id: FrustumId| {
            let frustum = &self.frusta[id.place()];
            let common: Vec<_> = frustum.half_spaces.iter().copied().chain(bounds.half_spaces()).collect();
            ImageBounds::around(corners(&common).into_iter().filter_map(|corner| frustum.image_from_world(corner)))
        };
        self.index.meeting(*bounds, 0.0).filter_map(in_frustum).reduce(ImageBounds::union)
    }

    /// How far outside of a plane rounding can put a point on it: a few roundings, in the planes' normals and in the products
    /// with them, of coordinates as large as the camera's and the point's. Eight in a product and about four in each number of a normal, by half of [`f64::EPSILON`]
    /// each, are ten of it: 64 are six times as many.
    fn rounding_m(&self, p_world: DVec3) -> f64 {
        64.0 * f64::EPSILON * (self.size_m + p_world.abs().max_element())
    }
}
