//! Small scenes made by code, of few meshes.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use scene::model::Animation;
use scene::{Bounds, Instance, LightArea, Material, Mesh, Scene, SceneLight, Snapshot, Vertex};

struct Still(Vec<DAffine3>);

impl Animation for Still {
    fn at(&self, _: &Scene, time_s: f64) -> Snapshot {
        Snapshot { time_s, world_from_mesh: self.0.clone(), deformed: Vec::new(), lights: Vec::new() }
    }
}

/// A mesh of one colour where it stands.
pub struct Placed {
    pub mesh: Mesh,
    pub world_from_mesh: DAffine3,
    /// Linear RGB.
    pub colour: [f32; 3],
}

/// The scene of some meshes; what is in them is turned about, not walked in.
pub fn scene(name: &str, placed: Vec<Placed>) -> Scene {
    let mut bounds = Bounds::EMPTY;
    for Placed { mesh, world_from_mesh, .. } in &placed {
        for vertex in &mesh.vertices {
            bounds.include(world_from_mesh.transform_point3(Vec3::from(vertex.position).as_dvec3()));
        }
    }
    let material = |colour: [f32; 3]| Material {
        base_colour: [colour[0], colour[1], colour[2], 1.0],
        double_sided: true,
        roughness: 1.0,
        ..Material::default()
    };
    let instance =
        |mesh: u32| Instance { mesh, name: format!("part {mesh}"), moves: false, deforms: false, tint: [255; 3] };
    let count = placed.len() as u32;
    let poses = placed.iter().map(|placed| placed.world_from_mesh).collect();
    Scene {
        name: name.to_owned(),
        materials: placed.iter().map(|placed| material(placed.colour)).collect(),
        meshes: placed.into_iter().zip(0..).map(|(placed, material)| Mesh { material, ..placed.mesh }).collect(),
        textures: Vec::new(),
        instances: (0..count).map(instance).collect(),
        lights_move: false,
        cameras: Vec::new(),
        bounds,
        walk: false,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        warnings: Vec::new(),
        animation: Arc::new(Still(poses)),
    }
}

/// Moved to a place, `scale` times as large.
pub fn at(place: DVec3, scale: f64) -> DAffine3 {
    DAffine3::from_translation(place) * DAffine3::from_scale(DVec3::splat(scale))
}

/// Triangles over corners, with their normals.
pub fn mesh(corners: impl IntoIterator<Item = (Vec3, Vec3)>, indices: Vec<u32>) -> Mesh {
    let vertex = |(position, normal): (Vec3, Vec3)| Vertex {
        position: position.to_array(),
        normal: normal.to_array(),
        uv: [0.0; 2],
        colour: [255; 4],
    };
    let vertices: Vec<Vertex> = corners.into_iter().map(vertex).collect();
    let places = || vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let bounds = [places().fold(Vec3::INFINITY, Vec3::min), places().fold(Vec3::NEG_INFINITY, Vec3::max)];
    Mesh { bounds: bounds.map(|corner| corner.to_array()), vertices, indices, ..Mesh::default() }
}

/// A square of side 2 in the plane z = 0 that faces +z, of two triangles.
pub fn square() -> Mesh {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| (Vec3::new(x, y, 0.0), Vec3::Z));
    mesh(corners, vec![0, 1, 2, 0, 2, 3])
}

/// A square floor around a place, so many metres from its middle to its sides.
pub fn floor(place: DVec3, half_m: f64) -> Placed {
    let mut floor = Placed { mesh: square(), world_from_mesh: at(place, half_m), colour: [0.4, 0.5, 0.3] };
    floor.world_from_mesh.matrix3 *= DMat3::from_rotation_x(-FRAC_PI_2);
    floor
}

/// A unit ball of longitudes and latitudes.
pub fn ball(rings: u32) -> Mesh {
    let steps = 2 * rings;
    let corner = |index: u32| {
        let (ring, step) = (index / (steps + 1), index % (steps + 1));
        let polar = ring as f32 / rings as f32 * std::f32::consts::PI;
        let turn = step as f32 / steps as f32 * std::f32::consts::TAU;
        let p = Vec3::new(polar.sin() * turn.cos(), polar.cos(), -polar.sin() * turn.sin());
        (p, p)
    };
    let cell = |index: u32| {
        let [a, b] = [index / steps, index / steps + 1].map(|ring| ring * (steps + 1) + index % steps);
        [a, b, b + 1, a, b + 1, a + 1]
    };
    mesh((0..(rings + 1) * (steps + 1)).map(corner), (0..rings * steps).flat_map(cell).collect())
}

/// From -1 to 1 along each axis, each face with its own normal.
pub fn cuboid() -> Mesh {
    let turns = [
        DQuat::IDENTITY,
        DQuat::from_rotation_y(PI / 2.0),
        DQuat::from_rotation_y(PI),
        DQuat::from_rotation_y(-PI / 2.0),
        DQuat::from_rotation_x(PI / 2.0),
        DQuat::from_rotation_x(-PI / 2.0),
    ];
    let corner =
        |turn: DQuat, [x, y]: [f64; 2]| ((turn * DVec3::new(x, y, 1.0)).as_vec3(), (turn * DVec3::Z).as_vec3());
    let face = |turn: DQuat| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|at| corner(turn, at));
    let indices = (0..6).flat_map(|face| [0, 1, 2, 0, 2, 3].map(|index| 4 * face + index));
    mesh(turns.into_iter().flat_map(face), indices.collect())
}

/// Where object `.0` is at time `.1`, which stands at `.2` by itself.
pub type Places = fn(usize, f64, DAffine3) -> DAffine3;

struct Moving {
    still: Arc<dyn Animation>,
    places: Places,
}

impl Animation for Moving {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let mut snapshot = self.still.at(scene, time_s);
        let moves =
            snapshot.world_from_mesh.iter_mut().enumerate().filter(|(object, _)| scene.instances[*object].moves);
        moves.for_each(|(object, place)| *place = (self.places)(object, time_s, *place));
        snapshot
    }
}

/// The same scene of which some objects move.
pub fn moving(mut scene: Scene, objects: &[usize], places: Places) -> Scene {
    objects.iter().for_each(|&object| scene.instances[object].moves = true);
    scene.animation = Arc::new(Moving { still: scene.animation, places });
    scene
}

struct Lit {
    unlit: Arc<dyn Animation>,
    lights: Vec<SceneLight>,
}

impl Animation for Lit {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        Snapshot { lights: self.lights.clone(), ..self.unlit.at(scene, time_s) }
    }
}

/// The same scene with lights of its own.
pub fn lit(mut scene: Scene, lights: Vec<SceneLight>) -> Scene {
    scene.animation = Arc::new(Lit { unlit: scene.animation, lights });
    scene
}

/// A light that shines to all sides, or from a square of so many metres a side that faces down.
pub fn lamp(position_world: DVec3, size_m: Option<f64>) -> SceneLight {
    let half = |size_m: f64| [DVec3::X * size_m / 2.0, DVec3::Z * size_m / 2.0];
    SceneLight::Point {
        position_world,
        colour: [1.0; 3],
        direction_world: DVec3::NEG_Y,
        spot_angles_rad: None,
        range_m: f32::INFINITY,
        area: size_m.map(|size_m| LightArea { half_world: half(size_m), is_disc: false }),
    }
}
