//! How much of an object's surface an image holds: the union of the footprints of its samples, over the area of the
//! mesh.
//!
//! The papers show the advantage of a single-pole image over a pinhole's as more samples of what is hidden
//! (*Non-pinhole impostors*, section 4); areas make it a number. They are measured by points spread over the mesh by
//! area: a point is held if a sample lies within its footprint, the width of a pixel at its depth, and faces the same
//! way within 45 degrees, to either side.

use camera::Camera;
use glam::{DVec2, DVec3};
use scene::{Scene, Snapshot};

use super::ImpostorCapture;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// In world space.
    pub position_world: DVec3,
    /// Unit normal of its triangle, in world space.
    pub normal_world: DVec3,
}

/// Normals of one surface differ by less than 45 degrees.
const LEAST_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// How far from a point's own pixel samples are looked for: a footprint is a pixel where the image is not stretched,
/// and two where a push stretches it.
const REACH_PX: i64 = 2;

/// `count` points on an object where it is in `snapshot`, each for the same area; none of an object without area, or
/// that is not in the scene.
pub fn surface_points(scene: &Scene, snapshot: &Snapshot, object: u16, count: usize) -> Vec<SurfacePoint> {
    let triangles = triangles(scene, snapshot, object);
    let mut ends_m2 = Vec::with_capacity(triangles.len());
    let mut whole_m2 = 0.0;
    for [a, b, c] in &triangles {
        whole_m2 += (b - a).cross(c - a).length() / 2.0;
        ends_m2.push(whole_m2);
    }
    let point = |index: usize| {
        let at_m2 = whole_m2 * (index as f64 + 0.5) / count as f64;
        let [a, b, c] = *triangles.get(ends_m2.partition_point(|end_m2| *end_m2 <= at_m2))?;
        // A sequence that fills the unit square evenly (Roberts, *The Unreasonable Effectiveness of Quasirandom
        // Sequences*, 2018).
        let [u, v] = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step: f64| (index as f64 * step).fract());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let normal_world = (b - a).cross(c - a).try_normalize()?;
        Some(SurfacePoint { position_world: a + (b - a) * u + (c - a) * v, normal_world })
    };
    (0..count).filter_map(point).collect()
}

/// The corners of an object's triangles in world space.
fn triangles(scene: &Scene, snapshot: &Snapshot, object: u16) -> Vec<[DVec3; 3]> {
    let object = usize::from(object);
    let (Some(instance), Some(world_from_mesh)) = (scene.instances.get(object), snapshot.world_from_mesh.get(object))
    else {
        return Vec::new();
    };
    let mesh = &scene.meshes[instance.mesh as usize];
    let deformed = snapshot.deformed.iter().find(|deformed| deformed.instance as usize == object);
    let vertices = deformed.map_or(&mesh.vertices, |deformed| &deformed.vertices);
    let place =
        |index: u32| world_from_mesh.transform_point3(glam::Vec3::from(vertices[index as usize].position).as_dvec3());
    let (corners, _) = mesh.indices.as_chunks::<3>();
    corners.iter().map(|corners| corners.map(place)).collect()
}

/// The share of points that an image holds, 0 to 1; 0 of none.
pub fn covered_share(points: &[SurfacePoint], capture: &ImpostorCapture) -> f64 {
    let held = points.iter().filter(|point| is_covered(point, capture)).count();
    held as f64 / points.len().max(1) as f64
}

/// Whether an image holds a sample within whose footprint a point lies.
pub fn is_covered(point: &SurfacePoint, capture: &ImpostorCapture) -> bool {
    let Some(image) = capture.camera.image_from_world(point.position_world) else { return false };
    let (width, height) = capture.camera.size_px();
    let (x, y) = (image.u.floor() as i64, image.v.floor() as i64);
    let around = (-REACH_PX..=REACH_PX).flat_map(|dy| (-REACH_PX..=REACH_PX).map(move |dx| (x + dx, y + dy)));
    let mut inside = around.filter(|&(x, y)| x >= 0 && y >= 0 && x < i64::from(width) && y < i64::from(height));
    inside.any(|(x, y)| {
        let index = (y * i64::from(width) + x) as usize;
        let Some(sample) = world_sample(capture, index) else { return false };
        sample.position_world.distance(point.position_world) <= sample.footprint_m
            && sample.normal_world.dot(point.normal_world).abs() > LEAST_COSINE
    })
}

/// A sample in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldSample {
    /// In world space, by the camera in f64.
    pub position_world: DVec3,
    /// Unit shading normal, in world space.
    pub normal_world: DVec3,
    /// The width of its pixel at its depth, the larger of both.
    pub footprint_m: f64,
}

/// What a pixel holds, in space; `None` where it holds nothing.
pub fn world_sample(capture: &ImpostorCapture, index: usize) -> Option<WorldSample> {
    if !capture.is_occupied(index) {
        return None;
    }
    let width = capture.camera.size_px().0 as usize;
    let centre_px = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    let w = f64::from(capture.w[index]);
    let unproject = unprojection(&capture.camera, centre_px, w)?;
    let across = |axis: DVec2| unproject(centre_px + axis / 2.0).distance(unproject(centre_px - axis / 2.0));
    Some(WorldSample {
        position_world: unproject(centre_px),
        normal_world: capture.normal_world(index),
        footprint_m: across(DVec2::X).max(across(DVec2::Y)),
    })
}

/// What takes image points around one, at its `w`, to world space.
fn unprojection(camera: &Camera, px: DVec2, w: f64) -> Option<Box<dyn Fn(DVec2) -> DVec3 + '_>> {
    let at = move |px: DVec2| camera::ImagePoint { u: px.x, v: px.y, w };
    Some(match camera {
        Camera::Pinhole(camera) => Box::new(move |px| camera.world_from_image(at(px))),
        Camera::Spoc(camera) => Box::new(move |px| camera.world_from_image(at(px))),
        Camera::Graph(camera) => {
            let frustum = camera.frustum(camera.frustum_at(at(px))?)?;
            Box::new(move |px| frustum.world_from_image(at(px)))
        }
    })
}
