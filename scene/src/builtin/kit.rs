//! Puts a built-in scene together: materials, meshes, and things that stand still, move or bend.

use std::sync::Arc;

use camera::{CorridorMap, Rigid, Trace, TracePose};
use glam::{DAffine3, DVec3, dvec3};
use rayon::prelude::*;

use super::mesher::{Mesher, linear};
use crate::model::{
    Animation, Bounds, Deformed, Instance, Material, Mesh, Scene, SceneCamera, SceneLight, Snapshot, Texture, Vertex,
};

/// Where a thing is after a share of the scene's period; it must return to its start at 1.
type Path = Box<dyn Fn(f64) -> DAffine3 + Send + Sync>;
/// A lamp after a share of the scene's period.
type Lamp = Box<dyn Fn(f64) -> SceneLight + Send + Sync>;
/// A thing's vertices after a share of the scene's period, from those at rest.
type Bend = Box<dyn Fn(f64, &[Vertex]) -> Vec<Vertex> + Send + Sync>;

enum Motion {
    Still(DAffine3),
    Rigid(Path),
    Bending(DAffine3, Bend),
}

/// A scene under construction.
pub(super) struct Kit {
    pub walk: bool,
    pub start: Option<SceneCamera>,
    pub corridors: Option<CorridorMap>,
    pub warnings: Vec<String>,
    textures: Vec<Texture>,
    materials: Vec<Material>,
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    motions: Vec<Motion>,
    lights: Vec<SceneLight>,
    lamps: Vec<Lamp>,
    period_s: f64,
}

impl Kit {
    /// All motion repeats after `period_s`.
    pub fn new(period_s: f64) -> Self {
        Kit {
            walk: false,
            start: None,
            corridors: None,
            warnings: Vec::new(),
            textures: Vec::new(),
            materials: Vec::new(),
            meshes: Vec::new(),
            instances: Vec::new(),
            motions: Vec::new(),
            lights: Vec::new(),
            lamps: Vec::new(),
            period_s,
        }
    }

    #[cfg(test)]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    pub fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Changes a material made before.
    pub fn alter(&mut self, material: u32, change: impl FnOnce(&mut Material)) {
        change(&mut self.materials[material as usize]);
    }

    /// A matt material of vertex colours only.
    pub fn painted(&mut self, name: &str) -> u32 {
        self.material(Material { name: name.into(), ..Material::default() })
    }

    /// A matt material with a texture.
    pub fn textured(&mut self, name: &str, texture: Texture) -> u32 {
        self.textures.push(texture);
        let texture = Some(self.textures.len() as u32 - 1);
        self.material(Material { name: name.into(), texture, ..Material::default() })
    }

    pub fn mesh(&mut self, mesher: Mesher, material: u32) -> u32 {
        self.raw_mesh(mesher.finish(material))
    }

    pub fn raw_mesh(&mut self, mesh: Mesh) -> u32 {
        self.meshes.push(mesh);
        self.meshes.len() as u32 - 1
    }

    fn add(&mut self, name: &str, mesh: u32, motion: Motion) {
        let moves = matches!(motion, Motion::Rigid(_));
        let deforms = matches!(motion, Motion::Bending(..));
        self.instances.push(Instance { mesh, name: name.into(), moves, deforms, tint: [255; 3] });
        self.motions.push(motion);
    }

    /// A thing that stands still.
    pub fn place(&mut self, name: &str, mesh: u32, world_from_mesh: DAffine3) {
        self.add(name, mesh, Motion::Still(world_from_mesh));
    }

    /// A thing that moves; the still scene shows it at the start of its path.
    pub fn drive(&mut self, name: &str, mesh: u32, path: impl Fn(f64) -> DAffine3 + Send + Sync + 'static) {
        self.add(name, mesh, Motion::Rigid(Box::new(path)));
    }

    /// A thing that bends; the still scene shows its mesh.
    pub fn bend(
        &mut self,
        name: &str,
        mesh: u32,
        world_from_mesh: DAffine3,
        bend: impl Fn(f64, &[Vertex]) -> Vec<Vertex> + Send + Sync + 'static,
    ) {
        self.add(name, mesh, Motion::Bending(world_from_mesh, Box::new(bend)));
    }

    /// Colours the thing added last, where its mesh is white.
    pub fn tint(&mut self, srgb: u32) {
        let [red, green, blue, _] = linear(srgb);
        self.instances.iter_mut().next_back().into_iter().for_each(|last| last.tint = [red, green, blue]);
    }

    pub fn light(&mut self, towards: DVec3, colour: [f32; 3]) {
        self.lights.push(SceneLight::Directional { direction_world: towards.normalize(), colour });
    }

    /// Takes all lights away.
    pub fn darken(&mut self) {
        self.lights.clear();
    }

    /// A light that moves.
    pub fn hang(&mut self, path: impl Fn(f64) -> SceneLight + Send + Sync + 'static) {
        self.lamps.push(Box::new(path));
    }

    /// A low warm sun, the sky above and what the ground throws back.
    pub fn daylight(&mut self) {
        self.light(dvec3(-0.55, -0.75, -0.4), [1.75, 1.62, 1.40]);
        self.light(dvec3(0.0, -1.0, 0.0), [0.26, 0.32, 0.40]);
        self.light(dvec3(0.75, -0.2, 0.6), [0.34, 0.38, 0.46]);
        self.light(dvec3(0.2, 0.9, -0.3), [0.28, 0.25, 0.20]);
    }

    /// A camera at `eye` towards `target`, 60 degrees high.
    pub fn look(&mut self, eye: DVec3, target: DVec3) {
        self.start = Some(camera(eye, target - eye));
    }

    /// The scene, with or without its motion.
    pub fn finish(self, name: &str, moving: bool) -> Scene {
        let mut instances = self.instances;
        for instance in &mut instances {
            instance.moves &= moving;
            instance.deforms &= moving;
        }
        let (period_s, motions, lights, lamps) = (self.period_s, self.motions, self.lights, self.lamps);
        let lights_move = moving && !lamps.is_empty();
        let animation = Motions { period_s, motions, lights, lamps, moving };
        let mut scene = Scene {
            name: name.into(),
            meshes: self.meshes,
            materials: self.materials,
            textures: self.textures,
            instances,
            lights_move,
            cameras: self.start.into_iter().collect(),
            bounds: Bounds::EMPTY,
            walk: self.walk,
            start: self.start,
            corridors: self.corridors,
            named_cameras: Vec::new(),
            offer: crate::load::Offer::default(),
            warnings: self.warnings,
            animation: Arc::new(animation),
        };
        scene.bounds = bounds(&scene, &scene.at(0.0));
        scene
    }
}

/// Height of a walker's eyes above the ground.
pub const EYE_HEIGHT_M: f64 = 1.7;

/// Poses of a [`super::reflection_path`].
const PATH_POSES: u32 = 60;
/// How many of them a second has.
const PATH_POSES_PER_S: f64 = 10.0;

/// The path of eyes that look at targets, both by the share of the path gone and the time.
pub(super) fn path(at: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Trace {
    let pose = |k: u32| {
        let t_s = f64::from(k) / PATH_POSES_PER_S;
        let (eye_world, target_world) = at(f64::from(k) / f64::from(PATH_POSES - 1), t_s);
        TracePose { t_s, world_from_eye: Rigid::look_at(eye_world, target_world) }
    };
    Trace { poses: (0..PATH_POSES).map(pose).collect() }
}

/// A camera 60 degrees high.
pub(super) fn camera(eye_world: DVec3, forward: DVec3) -> SceneCamera {
    SceneCamera { eye_world, forward_world: forward.normalize(), fov_y_rad: 60f64.to_radians() }
}

/// Extent of all vertices that triangles use.
fn bounds(scene: &Scene, snapshot: &Snapshot) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for (instance, world_from_mesh) in scene.instances.iter().zip(&snapshot.world_from_mesh) {
        let mesh = &scene.meshes[instance.mesh as usize];
        for &index in &mesh.indices {
            let position = DVec3::from(glam::Vec3::from(mesh.vertices[index as usize].position));
            bounds.include(world_from_mesh.transform_point3(position));
        }
    }
    bounds
}

struct Motions {
    period_s: f64,
    motions: Vec<Motion>,
    lights: Vec<SceneLight>,
    lamps: Vec<Lamp>,
    moving: bool,
}

impl Motions {
    /// Of the period.
    fn share(&self, time_s: f64) -> f64 {
        if self.moving { (time_s / self.period_s).rem_euclid(1.0) } else { 0.0 }
    }
}

impl Animation for Motions {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let share = self.share(time_s);
        let bent = |(index, motion): (usize, &Motion)| match motion {
            Motion::Bending(_, bend) if self.moving => {
                let mesh = &scene.meshes[scene.instances[index].mesh as usize];
                Some(Deformed { instance: index as u32, vertices: bend(share, &mesh.vertices) })
            }
            _ => None,
        };
        Snapshot {
            time_s,
            world_from_mesh: self.places(scene, time_s),
            deformed: self.motions.par_iter().enumerate().filter_map(bent).collect(),
            lights: self.lights.iter().copied().chain(self.lamps.iter().map(|lamp| lamp(share))).collect(),
        }
    }

    fn period_s(&self) -> Option<f64> {
        self.moving.then_some(self.period_s)
    }

    fn places(&self, _scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        let share = self.share(time_s);
        let place = |motion: &Motion| match motion {
            Motion::Still(place) | Motion::Bending(place, _) => *place,
            Motion::Rigid(path) => path(share),
        };
        self.motions.iter().map(place).collect()
    }
}
