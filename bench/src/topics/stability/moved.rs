//! A scene somewhere else.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use scene::model::{Animation, SceneCamera};
use scene::{Scene, SceneLight, Snapshot};

struct Moved {
    inner: Arc<dyn Animation>,
    by_m: DVec3,
}

impl Animation for Moved {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let mut snapshot = self.inner.at(scene, time_s);
        self.shift(&mut snapshot.world_from_mesh);
        for light in &mut snapshot.lights {
            if let SceneLight::Point { position_world, .. } = light {
                *position_world += self.by_m;
            }
        }
        snapshot
    }

    fn places(&self, scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        let mut places = self.inner.places(scene, time_s);
        self.shift(&mut places);
        places
    }
}

impl Moved {
    fn shift(&self, places: &mut [DAffine3]) {
        places.iter_mut().for_each(|place| place.translation += self.by_m);
    }
}

/// The scene with all that is in it moved, without its corridors and cameras to be asked for.
pub fn moved(scene: &Scene, by_m: DVec3) -> Scene {
    let mut scene = scene.clone();
    let camera = |camera: SceneCamera| SceneCamera { eye_world: camera.eye_world + by_m, ..camera };
    scene.cameras = scene.cameras.into_iter().map(camera).collect();
    scene.start = scene.start.map(camera);
    scene.bounds.min += by_m;
    scene.bounds.max += by_m;
    scene.corridors = None;
    scene.named_cameras.clear();
    scene.animation = Arc::new(Moved { inner: scene.animation, by_m });
    scene
}
