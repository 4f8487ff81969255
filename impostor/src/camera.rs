//! What cameras do for impostors beside projecting.

use ::camera::{Camera, Frustum, ImagePoint, Pinhole, Spoc};
use glam::DVec3;

/// The part of a camera that the points near an image point go by. Unlike the camera it goes on beyond its own end, so a
/// sample on a frustum's wall has neighbours.
pub(crate) enum Around<'a> {
    Pinhole(&'a Pinhole),
    Spoc(&'a Spoc),
    Frustum(&'a Frustum),
}

impl Around<'_> {
    /// What unprojects the points around an image point; `None` where no ray of the camera begins.
    pub fn new(camera: &Camera, point: ImagePoint) -> Option<Around<'_>> {
        match camera {
            Camera::Pinhole(camera) => Some(Around::Pinhole(camera)),
            Camera::Spoc(camera) => Some(Around::Spoc(camera)),
            Camera::Graph(camera) => camera.frustum(camera.frustum_at(point)?).map(Around::Frustum),
        }
    }

    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        match self {
            Around::Pinhole(camera) => camera.world_from_image(point),
            Around::Spoc(camera) => camera.world_from_image(point),
            Around::Frustum(frustum) => frustum.world_from_image(point),
        }
    }
}
