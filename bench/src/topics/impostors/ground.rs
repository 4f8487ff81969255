//! Ground for things that stand on none.

use glam::{DAffine3, DVec2, Vec3};
use scene::{Material, Mesh, Scene, Vertex};

/// Where ground is looked for: this share of the box in from each of its corners, where next to no thing but ground reaches.
const INSET: f64 = 0.02;
/// The side of ground that is made, in longest sides of the box.
const SIDE: f32 = 2.0;

/// The scene on a floor; as it is where at least three corners of its box have something below its middle. Its bounds stay those
/// of what stands on it.
pub(in crate::topics) fn grounded(scene: Scene) -> Scene {
    let (low, high) = (scene.bounds.min, scene.bounds.max);
    let middle = scene.bounds.centre();
    let [x, z] = [0, 2].map(|axis| [INSET, 1.0 - INSET].map(|share| low[axis] + (high[axis] - low[axis]) * share));
    let places: Vec<DVec2> = x.iter().flat_map(|x| z.map(|z| DVec2::new(*x, z))).collect();
    let heights_m = scene::heights_m(&scene, &scene.at(0.0), None, &places, middle.y);
    if scene.bounds.is_empty() || heights_m.iter().filter(|(below_m, _)| below_m.is_finite()).count() >= 3 {
        return scene;
    }
    let half = SIDE * (high - low).max_element() as f32 / 2.0;
    let vertex =
        |x: f32, z: f32| Vertex { position: [x, 0.0, z], normal: Vec3::Y.into(), uv: [0.0; 2], colour: [255; 4] };
    let vertices = vec![vertex(-half, half), vertex(half, half), vertex(half, -half), vertex(-half, -half)];
    let bounds = [[-half, 0.0, -half], [half, 0.0, half]];
    let ground = Mesh { vertices, indices: vec![0, 1, 2, 0, 2, 3], bounds, ..Mesh::default() };
    let place = DAffine3::from_translation(middle.with_y(low.y));
    let bounds = scene.bounds;
    Scene { bounds, ..scene.with("ground", ground, Material { name: "ground".into(), ..Material::default() }, place) }
}
