//! A scene with one thing more.

use std::sync::Arc;

use glam::DAffine3;

use crate::model::Animation;
use crate::{Instance, Material, Mesh, Rig, Scene, Snapshot};

impl Scene {
    /// The same with a thing that stands still, as its last instance. The mesh's own material number does not count.
    pub fn with(mut self, name: &str, mesh: Mesh, material: Material, world_from_mesh: DAffine3) -> Scene {
        let material_index = self.materials.len() as u32;
        self.materials.push(material);
        let mesh_index = self.meshes.len() as u32;
        let instance = Instance { mesh: mesh_index, name: name.into(), moves: false, deforms: false, tint: [255; 3] };
        self.meshes.push(Mesh { material: material_index, ..mesh });
        self.instances.push(instance);
        self.animation = Arc::new(Added { before: self.animation, world_from_mesh });
        let snapshot = self.at(0.0);
        if let Some(bounds) = self.bounds_of(&snapshot, self.instances.len() as u16 - 1) {
            self.bounds.include(bounds.min);
            self.bounds.include(bounds.max);
        }
        self
    }
}

struct Added {
    before: Arc<dyn Animation>,
    world_from_mesh: DAffine3,
}

impl Animation for Added {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let mut snapshot = self.before.at(scene, time_s);
        snapshot.world_from_mesh.push(self.world_from_mesh);
        snapshot
    }

    fn period_s(&self) -> Option<f64> {
        self.before.period_s()
    }

    fn places(&self, scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        let mut places = self.before.places(scene, time_s);
        places.push(self.world_from_mesh);
        places
    }

    fn rigs(&self) -> Vec<Rig> {
        self.before.rigs()
    }

    fn bones(&self, rig: &Rig, time_s: f64) -> Vec<DAffine3> {
        self.before.bones(rig, time_s)
    }
}
