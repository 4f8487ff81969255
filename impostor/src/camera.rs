use ::camera::{Frustum, GraphCamera, ImagePoint, Pinhole, Spoc};
use glam::DVec3;

use crate::curve::Curve;
use crate::ray::Ray;

/// The camera of an impostor. The set is closed.
#[derive(Debug, Clone, PartialEq)]
pub enum ImpostorCamera {
    /// One eye.
    Pinhole(Pinhole),
    /// One object and what lies behind its silhouette.
    Spoc(Spoc),
    /// A scene, round its corners.
    Graph(GraphCamera),
}

impl From<&::camera::Camera> for ImpostorCamera {
    fn from(camera: &::camera::Camera) -> ImpostorCamera {
        match camera {
            ::camera::Camera::Pinhole(camera) => ImpostorCamera::Pinhole(*camera),
            ::camera::Camera::Spoc(camera) => ImpostorCamera::Spoc(*camera),
            ::camera::Camera::Graph(camera) => ImpostorCamera::Graph(GraphCamera::clone(camera)),
        }
    }
}

impl ImpostorCamera {
    /// Image width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        match self {
            ImpostorCamera::Pinhole(camera) => (camera.width_px, camera.height_px),
            ImpostorCamera::Spoc(camera) => (camera.pinhole.width_px, camera.pinhole.height_px),
            ImpostorCamera::Graph(camera) => camera.size_px(),
        }
    }

    /// Where a world point lands; `None` where this camera has no image of it.
    pub fn image_from_world(&self, p_world: DVec3) -> Option<ImagePoint> {
        match self {
            ImpostorCamera::Pinhole(camera) => camera.image_from_world(p_world),
            ImpostorCamera::Spoc(camera) => camera.image_from_world(p_world),
            ImpostorCamera::Graph(camera) => camera.image_from_world(p_world).map(|(point, _)| point),
        }
    }

    /// What unprojects the points around an image point; `None` where no ray of the camera begins.
    pub(crate) fn around(&self, point: ImagePoint) -> Option<Around<'_>> {
        match self {
            ImpostorCamera::Pinhole(camera) => Some(Around::Pinhole(camera)),
            ImpostorCamera::Spoc(camera) => Some(Around::Spoc(camera)),
            ImpostorCamera::Graph(camera) => camera.frustum(camera.frustum_at(point)?).map(Around::Frustum),
        }
    }

    /// The curves that a finite ray projects to, in the order of `t`: one behind the near plane, or one for each frustum that it
    /// crosses.
    pub(crate) fn curves(&self, ray: &Ray) -> Vec<Curve<'_>> {
        match self {
            ImpostorCamera::Pinhole(camera) => Curve::of_pinhole(camera, ray, None).into_iter().collect(),
            ImpostorCamera::Spoc(camera) => Curve::of_pinhole(&camera.pinhole, ray, Some(camera)).into_iter().collect(),
            ImpostorCamera::Graph(camera) => Curve::of_graph(camera, ray),
        }
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
    pub fn world_from_image(&self, point: ImagePoint) -> DVec3 {
        match self {
            Around::Pinhole(camera) => camera.world_from_image(point),
            Around::Spoc(camera) => camera.world_from_image(point),
            Around::Frustum(frustum) => frustum.world_from_image(point),
        }
    }
}
