//! Small scenes whose pictures are known, and how tests draw them.
#![allow(dead_code)] // each test file uses a part

pub mod session;
pub mod triangles;
pub mod witness;

use std::f64::consts::TAU;
use std::sync::Arc;

use camera::{Pinhole, Rigid};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use gpu::Gpu;
use protocol::{Lighting, Look};
use scene::model::{Animation, Wrap};
use scene::{Bounds, Deformed, Instance, Material, Mesh, Scene, Snapshot, Texture, Vertex};
use vantage_server::discretize::{Capture, Discretization, Discretizer};
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
    Mesh { bounds, vertices, indices, material, ..Mesh::default() }
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
    let instance = |&(mesh, _): &(u32, DAffine3)| Instance {
        mesh,
        name: String::new(),
        moves: false,
        deforms: false,
        tint: [255; 3],
    };
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
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        lights_move: false,
        warnings: Vec::new(),
        animation: Arc::new(animation),
    }
}

/// A wall with a ball before it, seen from 4 m in front of the wall.
pub fn ball_before_wall() -> Scene {
    let at = |z: f64, scale: f64| {
        DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::new(0.0, 0.0, z))
    };
    scene(
        vec![square(4, 0), sphere(24, 0)],
        vec![coloured([0.6, 0.5, 0.4, 1.0])],
        &[(0, at(-4.0, 8.0)), (1, at(-2.5, 0.4))],
    )
}

/// A scene that moves as before, and then as `change` has it.
pub fn animated(scene: Scene, change: impl Fn(&mut Snapshot) + Send + Sync + 'static) -> Scene {
    let before = scene.animation.clone();
    Scene { animation: Arc::new(Changing { before, change }), ..scene }
}

struct Changing<F> {
    before: Arc<dyn Animation>,
    change: F,
}

impl<F: Fn(&mut Snapshot) + Send + Sync> Animation for Changing<F> {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let mut snapshot = Snapshot { time_s, ..self.before.at(scene, time_s) };
        (self.change)(&mut snapshot);
        snapshot
    }
}

/// A scene with one more object: a ball of 0.4 m, 2.5 m before the origin, moved by `world_from_rest` at a time.
pub fn with_ball(mut scene: Scene, world_from_rest: impl Fn(f64) -> DAffine3 + Send + Sync + 'static) -> Scene {
    let mesh = scene.meshes.len() as u32;
    scene.meshes.push(sphere(24, 0));
    scene.instances.push(Instance { mesh, name: String::new(), moves: true, deforms: false, tint: [255; 3] });
    let at_rest = DAffine3::from_translation(DVec3::Z * -2.5) * DAffine3::from_scale(DVec3::splat(0.4));
    animated(scene, move |snapshot| snapshot.world_from_mesh.push(world_from_rest(snapshot.time_s) * at_rest))
}

/// The wall alone, with a ball that moves, object 1.
pub fn moving_ball(world_from_rest: impl Fn(f64) -> DAffine3 + Send + Sync + 'static) -> Scene {
    let wall = DAffine3::from_translation(DVec3::Z * -4.0) * DAffine3::from_scale(DVec3::splat(8.0));
    with_ball(scene(vec![square(4, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &[(0, wall)]), world_from_rest)
}

/// From rest to a metre to either side, once in `period_s`.
pub fn swing(time_s: f64, period_s: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::X * (time_s * TAU / period_s).sin())
}

/// A room of two walls, with somebody of 1.8 m in its middle, object 2, who bends from side to side, once in `period_s`.
pub fn bending_figure(period_s: f64) -> Scene {
    let wall = DAffine3::from_scale_rotation_translation(DVec3::splat(8.0), DQuat::IDENTITY, DVec3::Z * -4.0);
    let floor = DAffine3::from_translation(DVec3::Y * -1.0)
        * DAffine3::from_rotation_x(-TAU / 4.0)
        * DAffine3::from_scale(DVec3::splat(8.0));
    let figure = DAffine3::from_translation(DVec3::Z * -2.2);
    let mut body = sphere(24, 0);
    for vertex in &mut body.vertices {
        let size = Vec3::new(0.35, 0.9, 0.25);
        vertex.position = (Vec3::from(vertex.position) * size).to_array();
        vertex.normal = (Vec3::from(vertex.normal) / size).normalize().to_array();
    }
    body.bounds = [[-0.8, -0.9, -0.25], [0.8, 0.9, 0.25]];
    let upright = body.vertices.clone();
    let materials = vec![coloured([0.6, 0.5, 0.4, 1.0])];
    let mut scene = scene(vec![square(4, 0), body], materials, &[(0, wall), (0, floor), (1, figure)]);
    scene.instances[2].deforms = true;
    animated(scene, move |snapshot| {
        let bend = 0.5 * (snapshot.time_s * TAU / period_s).sin() as f32;
        let vertices = upright.iter().map(|vertex| bent(vertex, bend)).collect();
        snapshot.deformed = vec![Deformed { instance: 2, vertices }];
    })
}

/// A wall of 3 m, two metres before the origin and object 0, that deforms: it slides along itself, by so many metres from one second on.
pub fn sliding_wall(slides_m: f32) -> Scene {
    let wall = DAffine3::from_translation(DVec3::Z * -2.0) * DAffine3::from_scale(DVec3::splat(1.5));
    let mut scene = scene(vec![square(4, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &[(0, wall)]);
    scene.instances[0].deforms = true;
    let before = scene.meshes[0].vertices.clone();
    animated(scene, move |snapshot| {
        let by = if snapshot.time_s < 1.0 { 0.0 } else { slides_m / 1.5 };
        let slid = |vertex: &Vertex| Vertex { position: [vertex.position[0] + by, vertex.position[1], 0.0], ..*vertex };
        snapshot.deformed = vec![Deformed { instance: 0, vertices: before.iter().map(slid).collect() }];
    })
}

/// `x' = x + b y^2`, and its normal by the inverse transpose.
fn bent(vertex: &Vertex, bend: f32) -> Vertex {
    let ([x, y, z], [nx, ny, nz]) = (vertex.position, vertex.normal);
    let normal = Vec3::new(nx, ny - 2.0 * bend * y * nx, nz).normalize();
    Vertex { position: [x + bend * y * y, y, z], normal: normal.to_array(), ..*vertex }
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

pub fn captures(renderer: &SceneRenderer, cameras: &[Pinhole], method: Discretization) -> Vec<Capture> {
    let mut discretizer = Discretizer::new(renderer).expect("pipelines");
    discretizer.run(renderer, cameras, method).expect("submitted").wait().expect("read back")
}
