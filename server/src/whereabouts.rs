//! Where everything is at a time, and whether any of it moved.

use std::sync::Arc;

use camera::Bounds;
use glam::{DVec3, Vec3};
use scene::{Scene, Snapshot};

/// Whether anything moved from one time to another.
pub fn is_moved(scene: &Scene, before: &Arc<Snapshot>, now: &Arc<Snapshot>) -> bool {
    let deforms = || scene.instances.iter().any(|instance| instance.deforms);
    let is_same = Arc::ptr_eq(before, now)
        || before.world_from_mesh == now.world_from_mesh && (before.time_s == now.time_s || !deforms());
    !is_same
}

/// A box around everything; around nothing, that of a point.
pub fn bounds(scene: &Scene, snapshot: &Snapshot) -> Bounds {
    let instances = (0..scene.instances.len()).map(|id| id as u16);
    let all = instances.filter_map(|id| bounds_of(scene, snapshot, id)).reduce(Bounds::union);
    all.unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO })
}

/// A box around an object as it is at a time; `None` around nothing.
pub fn bounds_of(scene: &Scene, snapshot: &Snapshot, id: u16) -> Option<Bounds> {
    let Some(deformed) = snapshot.deformed.iter().find(|deformed| deformed.instance == u32::from(id)) else {
        return scene.bounds_of(snapshot, id);
    };
    let world_from_mesh = snapshot.world_from_mesh.get(usize::from(id))?;
    let at = |vertex: &scene::Vertex| world_from_mesh.transform_point3(Vec3::from(vertex.position).as_dvec3());
    Bounds::around(deformed.vertices.iter().map(at))
}
