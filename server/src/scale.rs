//! A scene made larger or smaller about the world's origin.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use scene::model::{Animation, SceneCamera};
use scene::{Scene, SceneLight, Snapshot};

/// The scene with every length times `scale`, which must be positive and finite. Point lights grow with it, so that it
/// looks the same.
pub fn scaled(mut scene: Scene, scale: f64) -> Scene {
    let camera = |camera: SceneCamera| SceneCamera { eye_world: camera.eye_world * scale, ..camera };
    scene.cameras = scene.cameras.into_iter().map(camera).collect();
    scene.start = scene.start.map(camera);
    if !scene.bounds.is_empty() {
        scene.bounds.min *= scale;
        scene.bounds.max *= scale;
    }
    scene.animation = Arc::new(Scaled { inner: scene.animation, scale });
    scene
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

    fn places(&self, scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        let mut places = self.inner.places(scene, time_s);
        self.scale(&mut places);
        places
    }
}
