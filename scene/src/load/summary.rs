//! What is measured once a scene is complete: its bounds, and whether it is a place to walk in.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::{Bounds, Instance, Mesh, Snapshot, Vertex};

/// With more vertices than this to transform, the corners of meshes' boxes stand for them: bounds may be larger then.
const MAX_EXACT_VERTICES: usize = 1 << 24;

/// Bounds of what a snapshot shows.
pub(super) fn bounds(meshes: &[Mesh], instances: &[Instance], snapshot: &Snapshot) -> Bounds {
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

/// Whether a scene is walked in rather than turned: nothing in it deforms (a figure is looked at), it is at least
/// [`MIN_WALK_SIDE_M`] deep and wide, and it is either *flat*, no higher than a quarter of its depth and width (ground
/// with things on it), or *hollow*: its faces look at its middle more than away from it, as those of a room do.
///
/// 'Look at' is the sign of the flux of (p - middle) through the faces: three times the enclosed volume for a closed
/// surface seen from outside (divergence theorem), and negative for one seen from inside.
pub(super) fn is_walked(meshes: &[Mesh], instances: &[Instance], snapshot: &Snapshot, bounds: &Bounds) -> bool {
    if bounds.is_empty() || instances.iter().any(|instance| instance.deforms) {
        return false;
    }
    let size = bounds.max - bounds.min;
    let side = size.x.min(size.z);
    if side < MIN_WALK_SIDE_M {
        return false;
    }
    size.y <= side / FLAT_SIDE_PER_HEIGHT || outward_flux(meshes, instances, snapshot, bounds.centre()) < 0.0
}

/// Smaller scenes are objects in their own unit, or rooms too small to walk in.
const MIN_WALK_SIDE_M: f64 = 4.0;
/// A city block with towers is still flat; a vehicle or a machine is not.
const FLAT_SIDE_PER_HEIGHT: f64 = 4.0;

/// Integral of (p - centre) . n over all faces.
fn outward_flux(meshes: &[Mesh], instances: &[Instance], snapshot: &Snapshot, centre_world: DVec3) -> f64 {
    // Of each mesh about its own origin: sums of v0 . f and of f over its faces, where f = (v1 - v0) x (v2 - v0).
    let sums: Vec<(f64, DVec3)> = meshes
        .par_iter()
        .map(|mesh| {
            let point = |index: u32| DVec3::from(mesh.vertices[index as usize].position.map(f64::from));
            mesh.indices.as_chunks::<3>().0.iter().fold((0.0, DVec3::ZERO), |(volume, area), &[a, b, c]| {
                let a = point(a);
                let face = (point(b) - a).cross(point(c) - a);
                (volume + a.dot(face), area + face)
            })
        })
        .collect();
    instances
        .iter()
        .zip(&snapshot.world_from_mesh)
        .map(|(instance, world_from_mesh)| {
            let (volume, area) = sums[instance.mesh as usize];
            let centre_mesh = world_from_mesh.inverse().transform_point3(centre_world);
            // Faces of a mirrored instance look to the side that they have in their mesh: sizes count, not signs.
            world_from_mesh.matrix3.determinant().abs() * (volume - centre_mesh.dot(area))
        })
        .sum()
}
