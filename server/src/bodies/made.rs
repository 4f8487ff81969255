//! A body that is ready to be sent, or why there is none.

use std::sync::Arc;

use protocol::{Body, DepthImage};

/// A body that is ready to be sent.
#[derive(Debug)]
pub struct Made {
    /// Its colours and material, by texture coordinates.
    pub atlas: DepthImage,
    /// Its triangles.
    pub body: Arc<Body>,
    /// Where its space begins, of what bones move: in world space, and as the world lies. `None` of what is rigid: its space is that of its mesh.
    pub origin_world: Option<glam::DVec3>,
    /// About what both take on the wire.
    pub bytes: u64,
}

/// Why an object is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// Its textures say more than its colour.
    #[error("its material varies from place to place")]
    Varies,
    /// It is seen through, or lets light pass.
    #[error("it is seen through")]
    SeenThrough,
    /// Vertices that are seen through.
    #[error("its vertices say where it is cut out")]
    CutByVertices,
    /// More bones than clients have room for.
    #[error("it has more than {} bones", Body::MOST_BONES)]
    Bones,
    /// A clip that never ends.
    #[error("what its bones do is too long")]
    Long,
    /// A number that is infinite or not a number.
    #[error("its numbers leave their range")]
    NotFinite,
    /// It has no triangles.
    #[error("it has no triangles")]
    Empty,
}
