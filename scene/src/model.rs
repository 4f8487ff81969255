//! The scene as everything else sees it: meshes, materials and objects, and where they are at a time.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use camera::CorridorMap;
use camera::written::NamedCamera;
use glam::{DAffine3, DVec3};

/// A vertex, in its mesh's own space. Meshes are centred by the loader, so f32 is relative to the mesh, never to the world.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Metres.
    pub position: [f32; 3],
    /// Unit shading normal.
    pub normal: [f32; 3],
    /// Base colour texture coordinates, with `KHR_texture_transform` applied.
    pub uv: [f32; 2],
    /// Linear RGBA factor, 8 bits each: vertex colour.
    pub colour: [u8; 4],
}

/// Triangles with one material. Counter-clockwise triangles face the viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Shared by the triangles.
    pub vertices: Vec<Vertex>,
    /// Three a triangle, all in range.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Smallest and largest corner in mesh space, rest pose.
    pub bounds: [[f32; 3]; 2],
}

/// An image of a material: RGBA rows from the top, sRGB-encoded where it holds colours, and plain numbers where it holds normals.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Pixels.
    pub width_px: u32,
    /// Pixels.
    pub height_px: u32,
    /// Four bytes a pixel.
    pub rgba: Vec<u8>,
    /// How coordinates past the edge are read, along u and v.
    pub wrap: [Wrap; 2],
    /// Whether magnification picks the nearest texel.
    pub nearest: bool,
}

/// How texture coordinates past the edge are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats.
    Repeat,
    /// The image repeats mirrored.
    Mirror,
    /// The edge goes on.
    Clamp,
}

/// A surface as the file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// From the file, for messages.
    pub name: String,
    /// Linear RGBA.
    pub base_colour: [f32; 4],
    /// Index into [`Scene::textures`].
    pub texture: Option<u32>,
    /// How its normals differ from those of its vertices.
    pub bumps: Option<Bumps>,
    /// Fragments with less alpha are cut out; `None` where alpha does not matter. Blended materials are drawn as cut-outs.
    pub alpha_cutoff: Option<f32>,
    /// Drawn from both sides.
    pub double_sided: bool,
    /// Linear RGB.
    pub emissive: [f32; 3],
    /// 0 to 1.
    pub metallic: f32,
    /// 0 to 1.
    pub roughness: f32,
    /// 0 to 1.
    pub transmission: f32,
    /// 1 and more.
    pub ior: f32,
    /// Shown without lights.
    pub unlit: bool,
}

/// A normal map of glTF 2.0 (3.9.3): it tilts the vertices' normals, along the texture coordinates of the base colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bumps {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// What tilts are multiplied by.
    pub scale: f32,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_colour: [1.0; 4],
            texture: None,
            bumps: None,
            alpha_cutoff: None,
            double_sided: false,
            emissive: [0.0; 3],
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            ior: 1.5,
            unlit: false,
        }
    }
}

/// One drawing of a mesh. Its index in [`Scene::instances`] is its **object id**, stable over the life of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// From the file, for messages.
    pub name: String,
    /// Whether its transform changes over time.
    pub moves: bool,
    /// Whether its vertices change over time (skin, morph targets).
    pub deforms: bool,
    /// What its base colours are multiplied by: linear RGB, 255 for all of it. So one mesh serves things of many colours.
    pub tint: [u8; 3],
}

/// A light of a scene, in the file's units (lux, candela), at its place in world space at the snapshot's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneLight {
    /// Infinitely far; `direction_world` is the way the light travels, unit length.
    Directional {
        /// Unit vector.
        direction_world: DVec3,
        /// Linear RGB times lux.
        colour: [f32; 3],
    },
    /// A point, or a spot where `spot_angles_rad` is given (inner and outer half angle).
    Point {
        /// In world space.
        position_world: DVec3,
        /// Linear RGB times candela.
        colour: [f32; 3],
        /// The way a spot points, unit length.
        direction_world: DVec3,
        /// Inner and outer half angle.
        spot_angles_rad: Option<[f32; 2]>,
        /// Metres; infinite where the file gives none.
        range_m: f32,
        /// The surface that it shines from, around its position; `None` of a light without extent.
        area: Option<LightArea>,
    },
}

/// The surface of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightArea {
    /// From the middle to the middles of two sides, in world space, at right angles.
    pub half_world: [DVec3; 2],
    /// The ellipse in the rectangle, instead of all of it.
    pub is_disc: bool,
}

/// An axis-aligned box in world space. Empty where `min > max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Grows to hold a point.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// The middle.
    pub fn centre(&self) -> DVec3 {
        (self.min + self.max) / 2.0
    }

    /// Half of the diagonal, in metres; 0 when empty.
    pub fn radius_m(&self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.max - self.min).length() / 2.0 }
    }

    /// Whether nothing is inside.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }
}

/// Vertices of a deforming instance at a time: same count and order as its mesh, same space.
#[derive(Debug, Clone, PartialEq)]
pub struct Deformed {
    /// The instance, which is its object id.
    pub instance: u32,
    /// Replaces [`Mesh::vertices`].
    pub vertices: Vec<Vertex>,
}

/// A scene at a time.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Seconds.
    pub time_s: f64,
    /// `world_from_mesh` of each instance; may hold scale and shear, composed in f64. Always finite and invertible. Where
    /// it mirrors, the instance's mesh has its winding flipped, so that faces look outward after it; normals go by the
    /// inverse transpose (with the determinant's sign, so not by the cofactors alone).
    pub world_from_mesh: Vec<DAffine3>,
    /// The deforming instances only.
    pub deformed: Vec<Deformed>,
    /// Where the lights are.
    pub lights: Vec<SceneLight>,
}

/// A loaded scene.
#[derive(Clone)]
pub struct Scene {
    /// File stem or built-in name.
    pub name: String,
    /// Shared by instances.
    pub meshes: Vec<Mesh>,
    /// At least one.
    pub materials: Vec<Material>,
    /// Base colour images.
    pub textures: Vec<Texture>,
    /// What is drawn; at most 65,535.
    pub instances: Vec<Instance>,
    /// Whether [`Snapshot::lights`] change with time.
    pub lights_move: bool,
    /// Cameras of the file as `world_from_eye` with a vertical field of view, at time 0.
    pub cameras: Vec<SceneCamera>,
    /// Extent at time 0.
    pub bounds: Bounds,
    /// Whether it is meant to be walked in (at eye height on the ground) rather than turned.
    pub walk: bool,
    /// Where to begin; `None` where the bounds decide.
    pub start: Option<SceneCamera>,
    /// Where there is room between its walls, where its maker knows: what a graph camera is made of. Where it is `None`,
    /// [`crate::floor_plan`] may find out.
    pub corridors: Option<CorridorMap>,
    /// Cameras that viewers may ask for by their names; no two share one.
    pub named_cameras: Vec<NamedCamera>,
    /// What was dropped or mended while loading, for the log: each names the thing.
    pub warnings: Vec<String>,
    /// Evaluates the scene over time.
    pub animation: Arc<dyn Animation>,
}

/// A camera that a scene suggests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneCamera {
    /// Eye in world space.
    pub eye_world: DVec3,
    /// Unit vector.
    pub forward_world: DVec3,
    /// Vertical field of view.
    pub fov_y_rad: f64,
}

/// Where everything is at a time.
pub trait Animation: Send + Sync {
    /// The scene at `time_s`; any finite time is allowed, negative and hours included. Animations repeat.
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot;

    /// See [`Scene::places`].
    fn places(&self, scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        self.at(scene, time_s).world_from_mesh
    }
}

impl Scene {
    /// The scene at `time_s` in seconds.
    pub fn at(&self, time_s: f64) -> Snapshot {
        self.animation.at(self, time_s)
    }

    /// [`Snapshot::world_from_mesh`] at `time_s`, without anything else of the snapshot; of what deforms it may be any place.
    pub fn places(&self, time_s: f64) -> Vec<DAffine3> {
        self.animation.places(self, time_s)
    }

    /// Whether anything moves or deforms, a light included.
    pub fn is_animated(&self) -> bool {
        self.lights_move || self.instances.iter().any(|instance| instance.moves || instance.deforms)
    }

    /// The box in world space around the box of an instance's mesh at rest; `None` where the mesh has no vertices.
    pub fn bounds_of(&self, snapshot: &Snapshot, instance: u16) -> Option<camera::Bounds> {
        let place = snapshot.world_from_mesh.get(usize::from(instance))?;
        let mesh = self.meshes.get(self.instances.get(usize::from(instance))?.mesh as usize)?;
        let [min, max] = mesh.bounds.map(|corner| DVec3::from(corner.map(f64::from)));
        let corners = camera::Bounds { min, max }.corners();
        camera::Bounds::around(corners.map(|corner| place.transform_point3(corner))).filter(|_| min.cmple(max).all())
    }

    /// The same of the first object of a name, where it is at time 0; `None` where there is none.
    pub fn bounds_of_name(&self, name: &str) -> Option<camera::Bounds> {
        let instance = self.instances.iter().position(|instance| instance.name == name)?;
        self.bounds_of(&self.at(0.0), u16::try_from(instance).ok()?)
    }

    /// Triangles drawn, instances counted.
    pub fn triangle_count(&self) -> u64 {
        self.instances.iter().map(|instance| self.meshes[instance.mesh as usize].indices.len() as u64 / 3).sum()
    }
}
