use glam::{DMat3, DVec2, DVec3, Mat3};

use super::id::FrustumId;
use crate::{Bounds, HalfSpace, ImageBounds, ImagePoint};

/// A frustum of a graph camera: a convex body seen from one centre, whose rays all come in through one face. A frustum that
/// several others merge into is one of these for each of its faces, with the same name and centre, side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Frustum {
    pub(super) name: String,
    pub(super) parent: Option<FrustumId>,
    pub(super) children: Vec<FrustumId>,
    pub(super) centre_world: DVec3,
    pub(super) image_from_offset: DMat3,
    pub(super) offset_from_image: DMat3,
    pub(super) face: Vec<DVec3>,
    /// The face's plane, then those through the centre and an edge of the face, then the limits.
    pub(super) half_spaces: Vec<HalfSpace>,
    pub(super) corners: Vec<DVec3>,
    pub(super) bounds: Bounds,
    pub(super) image: ImageBounds,
}

/// A frustum's projection for the GPU; see [`Frustum::clip_from_offset`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipFromOffset {
    /// Takes a world point, relative to the frustum's centre, to `(u q, v q, q)`. Its columns together have unit length.
    pub matrix: Mat3,
    /// `w = w_scale/q`. In f64: at the end of a long chain it may be beyond f32.
    pub w_scale: f64,
}

impl Frustum {
    /// What the description calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The frustum whose rays arrive at this one's face; `None` for the root.
    pub fn parent(&self) -> Option<FrustumId> {
        self.parent
    }

    /// The frusta that this one's rays go on into.
    pub fn children(&self) -> &[FrustumId] {
        &self.children
    }

    /// The centre of projection, in world space.
    pub fn centre_world(&self) -> DVec3 {
        self.centre_world
    }

    /// The face that rays come in through, in world space: a convex polygon.
    pub fn face_world(&self) -> &[DVec3] {
        &self.face
    }

    /// The planes around it, in world space: that of the face first, then the sides through the centre and an edge of the
    /// face, in the order of its edges, then the limits.
    pub fn half_spaces_world(&self) -> &[HalfSpace] {
        &self.half_spaces
    }

    /// Its corners in world space, in no order; where more than three planes meet, more than once.
    pub fn corners_world(&self) -> &[DVec3] {
        &self.corners
    }

    /// The box around it.
    pub fn bounds_world(&self) -> Bounds {
        self.bounds
    }

    /// Where a world point of this frustum lands; `None` where a ray from the centre has no forward side. Whether the point
    /// lies in the frustum is not asked.
    pub fn image_from_world(&self, p_world: DVec3) -> Option<ImagePoint> {
        image_from_offset(&self.image_from_offset, p_world - self.centre_world)
    }

    /// The world point at an image point, as far as its ray belongs to this frustum; `w` must be positive.
    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        self.centre_world + self.ray_world(point.u, point.v) / point.w
    }

    /// What the points of the frustum cover of the image, and their inverse depths.
    pub fn image_bounds(&self) -> ImageBounds {
        self.image
    }

    /// The projection in f32, as it is composed in f64 and scaled to unit length: `H` itself leaves f32 along a chain.
    pub fn clip_from_offset(&self) -> ClipFromOffset {
        let size = self.image_from_offset.to_cols_array().map(|element| element.powi(2)).iter().sum::<f64>().sqrt();
        ClipFromOffset { matrix: (self.image_from_offset * size.recip()).as_mat3(), w_scale: size.recip() }
    }

    /// The direction of the ray of an image point, in world space: `1/w` times it, from the centre, is the point at `w`.
    pub(super) fn ray_world(&self, u: f64, v: f64) -> DVec3 {
        self.offset_from_image * DVec2::new(u, v).extend(1.0)
    }

    /// The planes through the centre, then the limits.
    pub(super) fn sides_and_limits(&self) -> (&[HalfSpace], &[HalfSpace]) {
        self.half_spaces[1..].split_at(self.face.len())
    }
}

/// Where a point lands, given relative to a frustum's centre: `(u, v, 1)/w` is `H` times it. `None` behind the centre, or where
/// numbers are not finite.
pub(super) fn image_from_offset(matrix: &DMat3, offset: DVec3) -> Option<ImagePoint> {
    let image = *matrix * offset;
    let (u, v, w) = (image.x / image.z, image.y / image.z, 1.0 / image.z);
    (w > 0.0 && w.is_finite() && u.is_finite() && v.is_finite()).then_some(ImagePoint { u, v, w })
}
