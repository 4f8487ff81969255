//! What cameras do for impostors beside projecting.

use ::camera::{Camera, Frustum, ImagePoint, Pinhole, Spoc};
use glam::DVec3;

use crate::curve::Curve;
use crate::ray::Ray;

/// The curves that a finite ray projects to, in the order of `t`: one behind the near plane, or one for each frustum that it
/// crosses.
pub(crate) fn curves<'a>(camera: &'a Camera, ray: &Ray) -> Vec<Curve<'a>> {
    match camera {
        Camera::Pinhole(camera) => Curve::of_pinhole(camera, ray, None).into_iter().collect(),
        Camera::Spoc(camera) => Curve::of_pinhole(&camera.pinhole, ray, Some(camera)).into_iter().collect(),
        Camera::Graph(camera) => Curve::of_graph(camera, ray),
    }
}

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
