//! Camera models: where a 3-D point lands in an image, and back. Pure maths in f64, no I/O, no GPU.
//!
//! Conventions, everywhere in Vantage:
//! - **World**: right-handed, y up, metres, seconds, radians.
//! - **Eye**: x right, **y down, z forward**, so the ray of the image point `(u, v)` is `(x', y', 1)`.
//! - **Image**: pixels, origin top left, pixel centres at +0.5.
//! - Depth is stored inverted as `w`; each camera defines its own. For [`Pinhole`], `w = 1/z` (1/m), which is linear in
//!   the image on a plane.
//! - Transforms are named by the spaces they connect, so that inner names cancel:
//!   `image_from_world = image_from_eye * eye_from_world`.
//!
//! Beside the pinhole stand two models that see more than one eye does: [`Spoc`] what lies just behind an object's silhouette,
//! [`GraphCamera`] round the corners of a whole scene.

mod bounds;
mod convex;
mod graph;
mod motion;
mod parallel;
mod pinhole;
mod rigid;
mod spoc;
mod trace;
pub mod written;

pub use bounds::{Bounds, ImageBounds};
pub use convex::HalfSpace;
pub use graph::{
    ClipFromOffset, CorridorMap, CorridorMapError, FaceDescription, FloorGrid, Frustum, FrustumDescription, FrustumId,
    GraphCamera, GraphDescription, GraphError, Heading, RayPiece, RootDescription, SegmentPiece, Storey, split_behind,
};
pub use motion::{Motion, Path};
pub use parallel::parallel_views;
pub use pinhole::{ImagePoint, Pinhole};
pub use rigid::{Rigid, turn_between, turn_of};
pub use spoc::{Spoc, SpocRay, SpocRayPiece};
pub use trace::{Trace, TraceError, TracePose};

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A camera model. The set is closed: every consumer handles each model, and the laws in `tests/laws.rs` hold for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Camera {
    /// A planar pinhole camera.
    Pinhole(Pinhole),
    /// A single-pole occlusion camera.
    Spoc(Spoc),
    /// A graph camera; shared, as it may have many frusta.
    Graph(Arc<GraphCamera>),
}

impl Camera {
    /// Image width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        let root = self.root();
        (root.width_px, root.height_px)
    }

    /// The pinhole whose image this is: the camera itself, the one before the push, the one where a graph's rays begin.
    pub fn root(&self) -> &Pinhole {
        match self {
            Camera::Pinhole(camera) => camera,
            Camera::Spoc(camera) => &camera.pinhole,
            Camera::Graph(camera) => camera.root(),
        }
    }

    /// The camera where it is a plain pinhole.
    pub fn pinhole(&self) -> Option<&Pinhole> {
        match self {
            Camera::Pinhole(camera) => Some(camera),
            Camera::Spoc(_) | Camera::Graph(_) => None,
        }
    }

    /// Where a world point lands, or `None` where this camera has no image of it.
    pub fn image_from_world(&self, p_world: DVec3) -> Option<ImagePoint> {
        match self {
            Camera::Pinhole(camera) => camera.image_from_world(p_world),
            Camera::Spoc(camera) => camera.image_from_world(p_world),
            Camera::Graph(camera) => camera.image_from_world(p_world).map(|(point, _)| point),
        }
    }

    /// The world point of an image point with its inverse depth; NaN where a graph camera has no ray.
    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        match self {
            Camera::Pinhole(camera) => camera.world_from_image(point),
            Camera::Spoc(camera) => camera.world_from_image(point),
            Camera::Graph(camera) => {
                let world = camera.frustum_at(point).and_then(|frustum| camera.world_from_image(point, frustum));
                world.unwrap_or(DVec3::NAN)
            }
        }
    }

    /// Whether every field is finite and in range: bytes from outside may hold anything. A graph camera is checked as it is made.
    pub fn is_valid(&self) -> bool {
        match self {
            Camera::Pinhole(camera) => camera.is_valid(),
            Camera::Spoc(camera) => camera.is_valid(),
            Camera::Graph(_) => true,
        }
    }

    /// The eye, in world space; of a graph camera the root's.
    pub fn eye_world(&self) -> DVec3 {
        self.root().world_from_eye.translation
    }
}
