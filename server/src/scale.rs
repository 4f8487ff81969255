//! A scene made larger or smaller about the world's origin.

use std::sync::Arc;

use camera::written::NamedCamera;
use camera::{Camera, GraphCamera, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DVec3};
use scene::model::{Animation, SceneCamera};
use scene::{Rig, Scene, SceneLight, Snapshot};

/// The scene with every length times `scale`, which must be positive and finite. Point lights grow with it, so that it
/// looks the same.
pub fn scaled(mut scene: Scene, scale: f64) -> Scene {
    let camera = |camera: SceneCamera| SceneCamera { eye_world: camera.eye_world * scale, ..camera };
    scene.cameras = scene.cameras.into_iter().map(camera).collect();
    scene.start = scene.start.map(camera);
    let named = |named: NamedCamera| Some(NamedCamera { camera: scaled_camera(&named.camera, scale)?, ..named });
    scene.named_cameras = scene.named_cameras.into_iter().filter_map(named).collect();
    if !scene.bounds.is_empty() {
        scene.bounds.min *= scale;
        scene.bounds.max *= scale;
    }
    scene.animation = Arc::new(Scaled { inner: scene.animation, scale });
    scene
}

/// A camera that sees in the larger scene what it sees in this one; `None` where numbers leave their range.
fn scaled_camera(camera: &Camera, scale: f64) -> Option<Camera> {
    let pinhole = |camera: &Pinhole| {
        let world_from_eye = Rigid { translation: camera.world_from_eye.translation * scale, ..camera.world_from_eye };
        Pinhole { world_from_eye, near_m: camera.near_m * scale, ..*camera }
    };
    let scaled = match camera {
        Camera::Pinhole(camera) => Camera::Pinhole(pinhole(camera)),
        Camera::Spoc(camera) => Camera::Spoc(Spoc {
            pinhole: pinhole(&camera.pinhole),
            push_from_m: camera.push_from_m * scale,
            push_to_m: camera.push_to_m * scale,
            ..*camera
        }),
        Camera::Graph(camera) => {
            let mut description = camera.description().clone();
            description.root.pinhole = pinhole(&description.root.pinhole);
            description.root.limits.iter_mut().for_each(|limit| limit.point *= scale);
            for frustum in &mut description.frusta {
                frustum.centre *= scale;
                frustum.limits.iter_mut().for_each(|limit| limit.point *= scale);
                frustum.faces.iter_mut().flat_map(|face| &mut face.corners).for_each(|corner| *corner *= scale);
            }
            Camera::Graph(Arc::new(GraphCamera::from_description(&description).ok()?))
        }
    };
    scaled.is_valid().then_some(scaled)
}

struct Scaled {
    inner: Arc<dyn Animation>,
    scale: f64,
}

impl Scaled {
    fn scale(&self, places: &mut [DAffine3]) {
        let scaled_from_world = DAffine3::from_scale(DVec3::splat(self.scale));
        places.iter_mut().for_each(|place| *place = scaled_from_world * *place);
    }
}

impl Animation for Scaled {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let mut snapshot = self.inner.at(scene, time_s);
        self.scale(&mut snapshot.world_from_mesh);
        for light in &mut snapshot.lights {
            if let SceneLight::Point { position_world, colour, range_m, area, .. } = light {
                *position_world *= self.scale;
                if let Some(area) = area {
                    area.half_world = area.half_world.map(|half| half * self.scale);
                }
                *range_m *= self.scale as f32;
                *colour = colour.map(|candela| candela * (self.scale * self.scale) as f32);
            }
        }
        snapshot
    }

    fn period_s(&self) -> Option<f64> {
        self.inner.period_s()
    }

    fn places(&self, scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        let mut places = self.inner.places(scene, time_s);
        self.scale(&mut places);
        places
    }

    fn rigs(&self) -> Vec<Rig> {
        self.inner.rigs()
    }

    fn bones(&self, rig: &Rig, time_s: f64) -> Vec<DAffine3> {
        let mut bones = self.inner.bones(rig, time_s);
        self.scale(&mut bones);
        bones
    }
}
