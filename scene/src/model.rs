//! The scene as everything else sees it: meshes, materials and objects, and where they are at a time.

use std::collections::BTreeSet;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use camera::CorridorMap;
use camera::written::NamedCamera;
use glam::{DAffine3, DVec3};

use crate::load::Offer;
use crate::rig::Rig;

/// A vertex, in its mesh's own space. Meshes are centred by the loader, so f32 is relative to the mesh, never to the world.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Metres.
    pub position: [f32; 3],
    /// Unit shading normal.
    pub normal: [f32; 3],
    /// Texture coordinates of the material's first texture, with `KHR_texture_transform` applied.
    pub uv: [f32; 2],
    /// Linear RGBA factor, 8 bits each: vertex colour.
    pub colour: [u8; 4],
}

/// Triangles with one material. Those that are counter-clockwise in the mesh's own space face the viewer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Shared by the triangles.
    pub vertices: Vec<Vertex>,
    /// Texture coordinates beside those of the vertices, as many; none where its material needs no others.
    pub second_uvs: Vec<[f32; 2]>,
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

impl Texture {
    /// What a hundredth of its texels lie below, 0 to 1, of a channel.
    pub fn low(&self, channel: usize) -> f32 {
        let mut histogram = [0_usize; 256];
        self.rgba.as_chunks::<4>().0.iter().for_each(|texel| histogram[usize::from(texel[channel])] += 1);
        let below = histogram.iter().scan(0, |below, count| {
            *below += count;
            Some(*below)
        });
        let hundredth = self.rgba.len() / 4 / 100;
        below.take_while(|&below| below <= hundredth).count().min(255) as f32 / 255.0
    }

    /// Mean of its texels, 0 to 1 a channel: of colours in linear light. By histogram: exact, and each of the 256 values is decoded once.
    pub fn mean(&self, is_colour: bool) -> [f32; 4] {
        let mut histogram = [[0_u64; 256]; 4];
        for texel in self.rgba.as_chunks::<4>().0 {
            texel.iter().zip(&mut histogram).for_each(|(&value, counts)| counts[usize::from(value)] += 1);
        }
        let linear_from_srgb =
            |value: f64| if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
        let texels = (self.rgba.len() / 4).max(1) as f64;
        std::array::from_fn(|channel| {
            let decode = |value: usize| match value as f64 / 255.0 {
                value if is_colour && channel < 3 => linear_from_srgb(value),
                value => value,
            };
            let counts = histogram[channel].iter().enumerate();
            (counts.map(|(value, &count)| decode(value) * count as f64).sum::<f64>() / texels) as f32
        })
    }
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
    /// Fragments with less alpha are cut out; `None` where alpha does not matter.
    pub alpha_cutoff: Option<f32>,
    /// Blended: its alpha is the share of what it shows, the rest is of what lies behind. Where surfaces are either there or not, it is cut out.
    pub see_through: bool,
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
    /// Whether light passes it straight on, as through a pane, and is not bent.
    pub thin: bool,
    /// 1 and more.
    pub ior: f32,
    /// How much of what its `ior` says a surface that is no metal mirrors, 0 to 1 (`KHR_materials_specular`).
    pub specular: f32,
    /// In which colour, as far as light does not graze: a factor, linear RGB.
    pub specular_colour: [f32; 3],
    /// The share of its clear coat, 0 to 1 (`KHR_materials_clearcoat`).
    pub clearcoat: f32,
    /// 0 to 1.
    pub clearcoat_roughness: f32,
    /// What the fibres on it scatter at grazing angles, linear RGB (`KHR_materials_sheen`).
    pub sheen: [f32; 3],
    /// 0 to 1.
    pub sheen_roughness: f32,
    /// Shown without lights.
    pub unlit: bool,
    /// What of it differs from place to place: each number above is multiplied by its texture's.
    pub maps: Vec<Map>,
}

/// A normal map of glTF 2.0 (3.9.3): it tilts the vertices' normals, along its texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bumps {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which texture coordinates it goes by.
    pub uv_set: UvSet,
    /// From those to its own.
    pub from_uv: UvMap,
    /// What tilts are multiplied by.
    pub scale: f32,
}

/// Which of a mesh's texture coordinates a texture goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UvSet {
    /// Those of its vertices.
    #[default]
    First,
    /// [`Mesh::second_uvs`].
    Second,
}

/// An affine map of texture coordinates: the rows of its matrix, and what is added behind.
pub type UvMap = [[f32; 3]; 2];

/// See [`UvMap`]: coordinates stay as they are.
pub const SAME_UV: UvMap = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// A texture that a number of a material is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Map {
    /// Of which number.
    pub quantity: Quantity,
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which texture coordinates it goes by.
    pub uv_set: UvSet,
    /// From those to its own.
    pub from_uv: UvMap,
    /// How far it is followed, 0 to 1: of an occlusion texture.
    pub strength: f32,
}

/// What a [`Map`] multiplies, and where glTF 2.0 keeps it in a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Roughness in green, metal in blue.
    MetallicRoughness,
    /// The share of the light from all around that arrives, in red.
    Occlusion,
    /// sRGB-encoded.
    Emissive,
    /// In red.
    Transmission,
    /// The factor alone, in alpha.
    Specular,
    /// sRGB-encoded.
    SpecularColour,
    /// In red.
    Clearcoat,
    /// In green.
    ClearcoatRoughness,
    /// sRGB-encoded.
    Sheen,
    /// In alpha.
    SheenRoughness,
}

impl Material {
    /// Whether a texture of it goes by [`Mesh::second_uvs`].
    pub fn needs_second_uvs(&self) -> bool {
        let sets = self.bumps.iter().map(|bumps| bumps.uv_set).chain(self.maps.iter().map(|map| map.uv_set));
        sets.into_iter().any(|set| set == UvSet::Second)
    }

    /// The roughness, 0 to 1, of the smoothest that it mirrors with: of itself or of its coat, in all but a hundredth of its texels.
    pub fn smoothest(&self, textures: &[Texture]) -> f32 {
        let by_map = |number: f32, quantity: Quantity| {
            let map = self.maps.iter().find(|map| map.quantity == quantity);
            map.map_or(number, |map| number * textures[map.texture as usize].low(1))
        };
        let own = by_map(self.roughness, Quantity::MetallicRoughness);
        let coat = by_map(self.clearcoat_roughness, Quantity::ClearcoatRoughness);
        if self.clearcoat > 0.0 { own.min(coat) } else { own }
    }

    /// Whether light passes it straight on: it does not hide what lies behind it, but dims and tints it.
    pub fn is_pane(&self) -> bool {
        self.thin && self.transmission > 0.0
    }

    /// What it emits on the whole, linear RGB.
    pub fn mean_emissive(&self, textures: &[Texture]) -> [f32; 3] {
        let map = self.maps.iter().find(|map| map.quantity == Quantity::Emissive);
        let mean = map.map_or([1.0; 4], |map| textures[map.texture as usize].mean(true));
        std::array::from_fn(|channel| self.emissive[channel] * mean[channel])
    }
}

impl Quantity {
    /// Whether its texels are sRGB-encoded colours.
    pub fn is_colour(self) -> bool {
        matches!(self, Quantity::Emissive | Quantity::SpecularColour | Quantity::Sheen)
    }
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_colour: [1.0; 4],
            texture: None,
            bumps: None,
            alpha_cutoff: None,
            see_through: false,
            double_sided: false,
            emissive: [0.0; 3],
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            thin: false,
            ior: 1.5,
            specular: 1.0,
            specular_colour: [1.0; 3],
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen: [0.0; 3],
            sheen_roughness: 0.0,
            unlit: false,
            maps: Vec::new(),
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
    /// it mirrors, faces still show the side that is counter-clockwise in their mesh (glTF 2.0, 3.7.4); normals go by the
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
    /// What else may be shown of its file, and what its cameras are called there.
    pub offer: Offer,
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

    /// After how long everything begins again, in seconds; `None` where it never does, or nobody knows.
    fn period_s(&self) -> Option<f64> {
        None
    }

    /// The instances that bones alone bend or move, in the same way over and over.
    fn rigs(&self) -> Vec<Rig> {
        Vec::new()
    }

    /// `world_from_mesh` of each bone of a [rig](Animation::rigs), which takes [`Rig::unbent`] to where that bone alone would have it.
    fn bones(&self, _rig: &Rig, _time_s: f64) -> Vec<DAffine3> {
        Vec::new()
    }
}

/// From this alpha on, of 255, hardly a step of a dark colour shines through.
const HIDES_ALL: u8 = 253;

impl Scene {
    /// What its meshes and images take in memory, in bytes.
    pub fn bytes(&self) -> u64 {
        let of_mesh =
            |mesh: &Mesh| size_of_val(&*mesh.vertices) + size_of_val(&*mesh.second_uvs) + size_of_val(&*mesh.indices);
        let meshes: usize = self.meshes.iter().map(of_mesh).sum();
        let images: usize = self.textures.iter().map(|texture| texture.rgba.len()).sum();
        (meshes + images) as u64
    }

    /// The scene at `time_s` in seconds.
    pub fn at(&self, time_s: f64) -> Snapshot {
        self.animation.at(self, time_s)
    }

    /// The materials of meshes that instances place, by index.
    pub fn shown_materials(&self) -> BTreeSet<u32> {
        let meshes = self.instances.iter().filter_map(|instance| self.meshes.get(instance.mesh as usize));
        meshes.map(|mesh| mesh.material).collect()
    }

    /// [`Snapshot::world_from_mesh`] at `time_s`, without anything else of the snapshot; of what deforms it may be any place.
    pub fn places(&self, time_s: f64) -> Vec<DAffine3> {
        self.animation.places(self, time_s)
    }

    /// Whether anything of a material is seen through: what is thin and lets light pass, and what is blended; files say of much that it is blended
    /// which hides all.
    pub fn is_seen_through(&self, material: usize) -> bool {
        let is_blended = |found: &Material| found.see_through && found.alpha_cutoff.is_some();
        let found = self.materials.get(material);
        found.is_some_and(|found| found.is_pane() || is_blended(found) && self.has_alpha(material, found))
    }

    /// Whether a material hides less than all anywhere, by its factor, its texture or the vertices that have it.
    fn has_alpha(&self, index: usize, material: &Material) -> bool {
        let texture = material.texture.and_then(|texture| self.textures.get(texture as usize));
        let of_texture =
            || texture.is_some_and(|texture| texture.rgba.as_chunks::<4>().0.iter().any(|texel| texel[3] < HIDES_ALL));
        let meshes = || self.meshes.iter().filter(|mesh| mesh.material as usize == index);
        let of_vertices = || meshes().any(|mesh| mesh.vertices.iter().any(|vertex| vertex.colour[3] < HIDES_ALL));
        material.base_colour[3] < f32::from(HIDES_ALL) / f32::from(u8::MAX) || of_texture() || of_vertices()
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
