//! The parts of a glTF document that are drawn with, as plain data.
//!
//! These types are our own rather than the `gltf` crate's, for three reasons: node transforms keep the f64 precision of
//! the JSON text (that crate rounds them to f32), references stay unchecked numbers until their reader names a wrong
//! one (that crate panics on some and truncates others), and an optional part that is missing or unknown is no error.
//! What is not named here is ignored. Names are those of the glTF 2.0 specification, section 5.

mod geometry;
mod material;

use std::collections::BTreeSet;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::load::{LoadError, Warnings};
use geometry::Buffer;
pub(super) use geometry::{Accessor, BufferView, Draco, Mesh, Meshopt, Primitive, Variant};
pub(super) use material::{Image, Material, Sampler, SpecularGlossiness, Texture, TextureInfo, TextureTransform};

/// A whole document. Indices are as in the file, unchecked.
#[derive(Debug, Default)]
pub(super) struct Document {
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Light>,
    pub variants: Vec<Variant>,
    pub extensions_required: Vec<String>,
    pub version: String,
    pub min_version: Option<String>,
}

impl Document {
    /// Reads a document; a value of the wrong type is named with its place.
    pub fn read(root: &Value) -> Result<Document, LoadError> {
        let Value::Object(object) = root else {
            return Err(LoadError::malformed("JSON", "the document is not an object"));
        };
        let asset: Asset = field(root.get("asset").unwrap_or(&Value::Null), "asset")?;
        let optional = |name: &str| object.get(name).map(|value| field(value, name)).transpose();
        let strings = |name: &str| object.get(name).map_or(Ok(Vec::new()), |value| field(value, name));
        let lights = root.pointer("/extensions/KHR_lights_punctual/lights");
        let variants = root.pointer("/extensions/KHR_materials_variants/variants");
        Ok(Document {
            scene: optional("scene")?,
            scenes: section(root, "scenes")?,
            nodes: section(root, "nodes")?,
            meshes: section(root, "meshes")?,
            accessors: section(root, "accessors")?,
            buffer_views: section(root, "bufferViews")?,
            buffers: section(root, "buffers")?,
            materials: section(root, "materials")?,
            textures: section(root, "textures")?,
            images: section(root, "images")?,
            samplers: section(root, "samplers")?,
            skins: section(root, "skins")?,
            animations: section(root, "animations")?,
            cameras: section(root, "cameras")?,
            lights: lights.map_or(Ok(Vec::new()), |value| elements(value, "extensions.KHR_lights_punctual.lights"))?,
            variants: variants
                .map_or(Ok(Vec::new()), |value| elements(value, "extensions.KHR_materials_variants.variants"))?,
            extensions_required: strings("extensionsRequired")?,
            version: asset.version,
            min_version: asset.min_version,
        })
    }
}

impl Document {
    /// Nodes that refer to meshes that do not exist show none; the lint names them.
    pub fn forget_unknown_meshes(&mut self) {
        let count = self.meshes.len();
        self.nodes.iter_mut().for_each(|node| node.mesh = node.mesh.filter(|&mesh| mesh < count));
    }

    /// Those of meshes that nodes place, of any scene. Nothing is read for others.
    pub fn shown_materials(&self) -> BTreeSet<usize> {
        let meshes = self.nodes.iter().filter_map(|node| self.meshes.get(node.mesh?));
        meshes.flat_map(|mesh| &mesh.primitives).filter_map(|primitive| primitive.material).collect()
    }

    /// A file without nodes is a library of meshes: each is given a node, so that it is shown where it was modelled.
    pub fn place_loose_meshes(&mut self, warnings: &mut Warnings) {
        if self.nodes.is_empty() && !self.meshes.is_empty() {
            warnings.add("the file has no nodes: its meshes are shown where they were modelled");
            self.nodes = (0..self.meshes.len()).map(|mesh| Node { mesh: Some(mesh), ..Node::default() }).collect();
        }
    }
}

fn field<T: DeserializeOwned>(value: &Value, at: &str) -> Result<T, LoadError> {
    T::deserialize(value).map_err(|error| LoadError::malformed(at, error.to_string()))
}

fn section<T: DeserializeOwned>(root: &Value, name: &str) -> Result<Vec<T>, LoadError> {
    root.get(name).map_or(Ok(Vec::new()), |value| elements(value, name))
}

fn elements<T: DeserializeOwned>(value: &Value, name: &str) -> Result<Vec<T>, LoadError> {
    let Value::Array(values) = value else {
        return Err(LoadError::malformed(name, "not an array"));
    };
    values.iter().enumerate().map(|(index, value)| field(value, &format!("{name}[{index}]"))).collect()
}

#[derive(Debug, Deserialize)]
struct Asset {
    version: String,
    #[serde(rename = "minVersion")]
    min_version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    pub name: Option<String>,
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub name: Option<String>,
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub camera: Option<usize>,
    pub weights: Option<Vec<f32>>,
    pub extras: Value,
    pub extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
}

#[derive(Debug, Deserialize)]
pub(super) struct NodeLight {
    pub light: usize,
}

#[derive(Debug, Deserialize)]
pub(super) struct Instancing {
    pub attributes: InstancingAttributes,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct InstancingAttributes {
    pub translation: Option<usize>,
    pub rotation: Option<usize>,
    pub scale: Option<usize>,
    /// By what exporters agree on: the extension leaves names that begin so to applications.
    #[serde(rename = "_COLOR_0")]
    pub colour: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub inverse_bind_matrices: Option<usize>,
    pub joints: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Channel {
    pub sampler: usize,
    pub target: Target,
}

#[derive(Debug, Deserialize)]
pub(super) struct Target {
    pub node: Option<usize>,
    pub path: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct AnimationSampler {
    pub input: usize,
    pub output: usize,
    pub interpolation: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Perspective {
    pub yfov: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Light {
    #[serde(rename = "type")]
    pub kind: String,
    pub color: Option<[f32; 3]>,
    pub intensity: Option<f32>,
    pub range: Option<f32>,
    #[serde(default)]
    pub spot: Spot,
    /// Ours: `radius` of a disc or `size` (width and height) of a rectangle that the light shines from, in metres.
    #[serde(default)]
    pub extras: Value,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Spot {
    pub inner_cone_angle: f32,
    pub outer_cone_angle: Option<f32>,
}
