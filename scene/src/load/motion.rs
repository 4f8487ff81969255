//! Scenes in which nothing moves.

use glam::DAffine3;

use crate::model::Animation;
use crate::{Scene, SceneLight, Snapshot};

/// The same places at all times.
#[derive(Debug, Clone, Default)]
pub(super) struct Still {
    /// Of each instance.
    pub world_from_mesh: Vec<DAffine3>,
    /// Of the file.
    pub lights: Vec<SceneLight>,
}

impl Still {
    /// The only snapshot there is, at any time.
    pub fn snapshot(&self, time_s: f64) -> Snapshot {
        Snapshot {
            time_s,
            world_from_mesh: self.world_from_mesh.clone(),
            deformed: Vec::new(),
            lights: self.lights.clone(),
        }
    }
}

impl Animation for Still {
    fn at(&self, _scene: &Scene, time_s: f64) -> Snapshot {
        self.snapshot(time_s)
    }
}
