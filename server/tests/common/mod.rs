//! Small scenes whose pictures are known, and how tests draw them.
#![allow(dead_code)] // each test file uses a part

use std::sync::Arc;

use camera::{Pinhole, Rigid};
use glam::{DAffine3, DVec3, Vec3};
use gpu::Gpu;
use protocol::{Lighting, Look};
use scene::model::{Animation, Wrap};
use scene::{Bounds, Deformed, Instance, Material, Mesh, Scene, Snapshot, Texture, Vertex};
use vantage_server::discretize::{Capture, Discretization, Discretizer, TexelTest};
use vantage_server::look::SceneLook;
use vantage_server::render::SceneRenderer;
use vantage_server::truth::{Truth, TruthRenderer};

/// The adapter; a machine without one fails the test.
pub fn gpu() -> Gpu {
    Gpu::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not")
}

/// Nothing moves; deforming vertices may be given.
#[derive(Clone, Default)]
pub struct Still {
    pub world_from_mesh: Vec<DAffine3>,
    pub deformed: Vec<Deformed>,
}

impl Animation for Still {
    fn at(&self, _: &Scene, time_s: f64) -> Snapshot {
        Snapshot {
            time_s,
            world_from_mesh: self.world_from_mesh.clone(),
            deformed: if time_s > 0.0 { self.deformed.clone() } else { Vec::new() },
            lights: Vec::new(),
        }
    }
}

pub fn vertex(position: Vec3, normal: Vec3, uv: [f32; 2]) -> Vertex {
    Vertex { position: position.to_array(), normal: normal.to_array(), uv, colour: [255; 4] }
}

pub fn mesh(vertices: Vec<Vertex>, indices: Vec<u32>, material: u32) -> Mesh {
    let positions = || vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let bounds = [
        positions().fold(Vec3::INFINITY, Vec3::min).to_array(),
        positions().fold(Vec3::NEG_INFINITY, Vec3::max).to_array(),
    ];
    Mesh { bounds, vertices, indices, material }
}

/// A square of side 2 in the plane z = 0 that faces +z, in `cells` x `cells` pairs of triangles.
pub fn square(cells: u32, material: u32) -> Mesh {
    let at = |step: u32| step as f32 / cells as f32;
    let mut vertices = Vec::new();
    for y in 0..=cells {
        for x in 0..=cells {
            let p = Vec3::new(2.0 * at(x) - 1.0, 2.0 * at(y) - 1.0, 0.0);
            vertices.push(vertex(p, Vec3::Z, [at(x), 1.0 - at(y)]));
        }
    }
    let mut indices = Vec::new();
    for y in 0..cells {
        for x in 0..cells {
            let [a, b] = [y * (cells + 1) + x, (y + 1) * (cells + 1) + x];
            indices.extend([a, a + 1, b + 1, a, b + 1, b]);
        }
    }
    mesh(vertices, indices, material)
}

/// A unit sphere of longitudes and latitudes.
pub fn sphere(steps: u32, material: u32) -> Mesh {
    let mut vertices = Vec::new();
    for ring in 0..=steps {
        for step in 0..=2 * steps {
            let (polar, turn) =
                (ring as f32 / steps as f32 * std::f32::consts::PI, step as f32 / steps as f32 * std::f32::consts::PI);
            let p = Vec3::new(polar.sin() * turn.cos(), polar.cos(), -polar.sin() * turn.sin());
            vertices.push(vertex(p, p, [0.0; 2]));
        }
    }
    let mut indices = Vec::new();
    for ring in 0..steps {
        for step in 0..2 * steps {
            let [a, b] = [ring * (2 * steps + 1) + step, (ring + 1) * (2 * steps + 1) + step];
            indices.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    mesh(vertices, indices, material)
}

/// A scene of `(mesh index, world_from_mesh)`.
pub fn scene(meshes: Vec<Mesh>, materials: Vec<Material>, placed: &[(u32, DAffine3)]) -> Scene {
    let animation = Still {
        world_from_mesh: placed.iter().map(|(_, world_from_mesh)| *world_from_mesh).collect(),
        deformed: Vec::new(),
    };
    let instance = |&(mesh, _): &(u32, DAffine3)| Instance { mesh, name: String::new(), moves: false, deforms: false };
    Scene {
        name: "test".into(),
        meshes,
        materials,
        textures: Vec::new(),
        instances: placed.iter().map(instance).collect(),
        cameras: Vec::new(),
        bounds: Bounds { min: DVec3::splat(-10.0), max: DVec3::splat(10.0) },
        walk: false,
        start: None,
        warnings: Vec::new(),
        animation: Arc::new(animation),
    }
}

pub fn coloured(base_colour: [f32; 4]) -> Material {
    Material { base_colour, ..Material::default() }
}

pub fn texture(width_px: u32, height_px: u32, nearest: bool, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let pixels = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
    Texture {
        width_px,
        height_px,
        rgba: pixels.flat_map(|(x, y)| texel(x, y)).collect(),
        wrap: [Wrap::Clamp; 2],
        nearest,
    }
}

/// An eye at `eye` that looks along -z, 90 degrees.
pub fn looking_back(eye: DVec3, size_px: u32) -> Pinhole {
    let world_from_eye = Rigid::look_along(eye, DVec3::NEG_Z);
    Pinhole::symmetric(world_from_eye, (size_px, size_px), std::f64::consts::FRAC_PI_2, 0.1)
}

pub fn flat(scene: &Scene) -> Lighting {
    SceneLook::new(scene, Look::Flat).lighting(&scene.at(0.0))
}

/// The renderer of a scene, anchored at an eye.
pub fn renderer(gpu: &Gpu, scene: &Scene, camera: &Pinhole) -> SceneRenderer {
    let mut renderer = SceneRenderer::new(gpu, scene).expect("the scene uploads");
    renderer.update(&scene.at(0.0), camera.world_from_eye.translation).expect("same scene");
    renderer
}

pub fn truth(gpu: &Gpu, scene: &Scene, camera: &Pinhole) -> Truth {
    let renderer = renderer(gpu, scene, camera);
    TruthRenderer::new(&renderer).expect("pipelines").render(&renderer, camera, &flat(scene)).expect("a picture")
}

pub fn captures(
    renderer: &SceneRenderer,
    cameras: &[Pinhole],
    method: Discretization,
    texel_test: TexelTest,
) -> Vec<Capture> {
    let mut discretizer = Discretizer::new(renderer, texel_test).expect("pipelines");
    discretizer.run(renderer, cameras, method).expect("submitted").wait().expect("read back")
}
