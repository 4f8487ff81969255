//! The triangles of a scene, by themselves.

use glam::{DVec3, Vec3};
use scene::Scene;

/// Every triangle of a scene at rest, at the place of its id less 1.
pub fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let snapshot = scene.at(0.0);
    let of_instance = |(object, instance): (usize, &scene::Instance)| {
        let (mesh, place) = (&scene.meshes[instance.mesh as usize], snapshot.world_from_mesh[object]);
        let at =
            move |index: u32| place.transform_point3(Vec3::from(mesh.vertices[index as usize].position).as_dvec3());
        mesh.indices.chunks_exact(3).map(move |corners| [at(corners[0]), at(corners[1]), at(corners[2])])
    };
    scene.instances.iter().enumerate().flat_map(of_instance).collect()
}

fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    p.distance(a + along * ((p - a).dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0))
}

/// The distance of a point from a triangle, in metres.
pub fn distance_to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let is_inside = |a: DVec3, b: DVec3| (b - a).cross(p - a).dot(normal) >= 0.0;
    if normal.length() > 0.0 && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
        return ((p - a).dot(normal) / normal.length()).abs();
    }
    [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| distance_to_segment(p, a, b)).fold(f64::INFINITY, f64::min)
}
