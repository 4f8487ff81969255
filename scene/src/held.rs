//! A scene that stands still at one moment of its animation.

use std::sync::Arc;

use glam::Vec3;

use crate::model::Animation;
use crate::{Deformed, Mesh, Scene, Snapshot};

impl Scene {
    /// The scene as it is at `time_s`, at all times. What deforms gets a mesh of its own with the vertices of that moment.
    pub fn held_at(mut self, time_s: f64) -> Scene {
        let mut snapshot = self.at(time_s);
        for deformed in std::mem::take(&mut snapshot.deformed) {
            let instance = &mut self.instances[deformed.instance as usize];
            let mesh = moulded(&self.meshes[instance.mesh as usize], deformed);
            instance.mesh = self.meshes.len() as u32;
            self.meshes.push(mesh);
        }
        for instance in &mut self.instances {
            (instance.moves, instance.deforms) = (false, false);
        }
        self.lights_move = false;
        self.animation = Arc::new(Held { snapshot });
        self
    }
}

fn moulded(mesh: &Mesh, deformed: Deformed) -> Mesh {
    let corners = mesh.indices.iter().map(|&index| Vec3::from(deformed.vertices[index as usize].position));
    let around = |[low, high]: [Vec3; 2], corner: Vec3| [low.min(corner), high.max(corner)];
    let bounds = corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], around);
    let bounds = if mesh.indices.is_empty() { mesh.bounds } else { bounds.map(|corner| corner.to_array()) };
    let Mesh { second_uvs, indices, material, .. } = mesh;
    Mesh {
        vertices: deformed.vertices,
        second_uvs: second_uvs.clone(),
        indices: indices.clone(),
        material: *material,
        bounds,
    }
}

struct Held {
    snapshot: Snapshot,
}

impl Animation for Held {
    fn at(&self, _scene: &Scene, time_s: f64) -> Snapshot {
        Snapshot { time_s, ..self.snapshot.clone() }
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin;

    #[test]
    fn what_moves_and_deforms_stands_as_it_was() {
        let mut held_some = [false; 2];
        for name in builtin::names() {
            let Some(scene) = builtin::load(name).filter(|scene| scene.is_animated()) else { continue };
            let then = scene.at(0.75);
            let held = scene.clone().held_at(0.75);
            assert!(!held.is_animated(), "{name}");
            let now = held.at(3.0);
            assert_eq!((now.time_s, &now.world_from_mesh, &now.lights), (3.0, &then.world_from_mesh, &then.lights));
            assert!(now.deformed.is_empty());
            for deformed in &then.deformed {
                let mesh = &held.meshes[held.instances[deformed.instance as usize].mesh as usize];
                assert_eq!(mesh.vertices, deformed.vertices, "{name}");
            }
            held_some[usize::from(!then.deformed.is_empty())] = true;
        }
        assert_eq!(held_some, [true; 2], "no built-in scene moves, or none deforms");
    }
}
