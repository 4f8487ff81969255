//! The space that a scene takes up.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::{Bounds, Instance, Mesh, Snapshot, Vertex};

/// With more vertices than this to transform, the corners of meshes' boxes stand for them: bounds may be larger then.
const MAX_EXACT_VERTICES: usize = 1 << 24;

/// The box around everything that a snapshot shows.
pub fn extent(meshes: &[Mesh], instances: &[Instance], snapshot: &Snapshot) -> Bounds {
    let mut vertices: Vec<&[Vertex]> =
        instances.iter().map(|instance| meshes[instance.mesh as usize].vertices.as_slice()).collect();
    for deformed in &snapshot.deformed {
        vertices[deformed.instance as usize] = &deformed.vertices;
    }
    let exact = vertices.iter().map(|vertices| vertices.len()).sum::<usize>() <= MAX_EXACT_VERTICES;
    let parts: Vec<Bounds> = vertices
        .par_iter()
        .zip(instances)
        .zip(&snapshot.world_from_mesh)
        .map(|((vertices, instance), world_from_mesh)| {
            if !exact {
                return corners(&meshes[instance.mesh as usize].bounds, world_from_mesh);
            }
            let mut bounds = Bounds::EMPTY;
            for vertex in *vertices {
                bounds.include(world_from_mesh.transform_point3(DVec3::from(vertex.position.map(f64::from))));
            }
            bounds
        })
        .collect();
    let mut all = Bounds::EMPTY;
    for part in parts.iter().filter(|part| !part.is_empty()) {
        all.include(part.min);
        all.include(part.max);
    }
    all
}

/// World bounds of a box in mesh space.
fn corners(mesh_bounds: &[[f32; 3]; 2], world_from_mesh: &DAffine3) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for corner in 0..8 {
        let pick = |axis: usize| f64::from(mesh_bounds[corner >> axis & 1][axis]);
        bounds.include(world_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
    }
    bounds
}
