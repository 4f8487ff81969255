//! The parts of a glTF document that are drawn with, as plain data.
//!
//! These types are our own rather than the `gltf` crate's, for three reasons: node transforms keep the f64 precision of
//! the JSON text (that crate rounds them to f32), references stay unchecked numbers until their reader names a wrong
//! one (that crate panics on some and truncates others), and an optional part that is missing or unknown is no error.
//! What is not named here is ignored. Names are those of the glTF 2.0 specification, section 5.

use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::Value;

use crate::load::{LoadError, Warnings};
use crate::model::Quantity;

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
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    pub weights: Option<Vec<f32>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub attributes: std::collections::BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u32>,
    #[serde(default)]
    pub targets: Vec<std::collections::BTreeMap<String, usize>>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Option<Variants>,
}

/// Which material a primitive has in which variants.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Variants {
    pub mappings: Vec<VariantMaterial>,
}

#[derive(Debug, Deserialize)]
pub(super) struct VariantMaterial {
    pub material: usize,
    #[serde(default)]
    pub variants: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Variant {
    pub name: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub buffer_view: usize,
    /// By name, the id that the compressed stream has for it.
    pub attributes: std::collections::BTreeMap<String, u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
    #[serde(default)]
    pub extensions: BufferViewExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct BufferViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub meshopt: Option<Meshopt>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Meshopt {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
    #[serde(default)]
    pub extensions: BufferExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct BufferExtensions {
    /// Present where the buffer is only for readers without the extension, and may have no data.
    #[serde(rename = "EXT_meshopt_compression")]
    pub fallback: Option<Fallback>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Fallback {}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    pub name: Option<String>,
    pub pbr_metallic_roughness: MetallicRoughness,
    pub emissive_factor: [f32; 3],
    pub emissive_texture: Option<TextureInfo>,
    pub normal_texture: Option<TextureInfo>,
    pub occlusion_texture: Option<TextureInfo>,
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f32>,
    pub double_sided: bool,
    pub extensions: MaterialExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub base_color_factor: Option<[f32; 4]>,
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Option<f32>,
    pub roughness_factor: Option<f32>,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_unlit")]
    pub unlit: Option<Unlit>,
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Option<Specular>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub clearcoat: Option<Clearcoat>,
    #[serde(rename = "KHR_materials_sheen")]
    pub sheen: Option<Sheen>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
    #[serde(rename = "KHR_materials_anisotropy")]
    pub anisotropy: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_iridescence")]
    pub iridescence: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_dispersion")]
    pub dispersion: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    pub diffuse_transmission: Option<IgnoredAny>,
}

impl MaterialExtensions {
    /// Those that the material has and that are not drawn.
    pub fn not_drawn(&self) -> impl Iterator<Item = &'static str> {
        let named = [
            ("anisotropy", &self.anisotropy),
            ("iridescence", &self.iridescence),
            ("dispersion", &self.dispersion),
            ("diffuse transmission", &self.diffuse_transmission),
        ];
        named.into_iter().filter_map(|(name, found)| found.is_some().then_some(name))
    }
}

impl Material {
    /// The textures that it is drawn with and what they say; `None` of base colours and normals, the first ones.
    pub fn textures(&self) -> impl Iterator<Item = (Option<Quantity>, &TextureInfo)> {
        let (pbr, more) = (&self.pbr_metallic_roughness, &self.extensions);
        let glossy = more.specular_glossiness.as_ref().and_then(|glossy| glossy.diffuse_texture.as_ref());
        let coat = more.clearcoat.as_ref();
        let sheen = more.sheen.as_ref();
        let specular = more.specular.as_ref();
        let all = [
            (None, pbr.base_color_texture.as_ref().or(glossy)),
            (None, self.normal_texture.as_ref()),
            (Some(Quantity::MetallicRoughness), pbr.metallic_roughness_texture.as_ref()),
            (Some(Quantity::Occlusion), self.occlusion_texture.as_ref()),
            (Some(Quantity::Emissive), self.emissive_texture.as_ref()),
            (Some(Quantity::Transmission), more.transmission.as_ref().and_then(|t| t.transmission_texture.as_ref())),
            (Some(Quantity::Specular), specular.and_then(|s| s.specular_texture.as_ref())),
            (Some(Quantity::SpecularColour), specular.and_then(|s| s.specular_color_texture.as_ref())),
            (Some(Quantity::Clearcoat), coat.and_then(|c| c.clearcoat_texture.as_ref())),
            (Some(Quantity::ClearcoatRoughness), coat.and_then(|c| c.clearcoat_roughness_texture.as_ref())),
            (Some(Quantity::Sheen), sheen.and_then(|s| s.sheen_color_texture.as_ref())),
            (Some(Quantity::SheenRoughness), sheen.and_then(|s| s.sheen_roughness_texture.as_ref())),
        ];
        all.into_iter().filter_map(|(quantity, info)| Some((quantity, info?)))
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Unlit {}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Transmission {
    #[serde(default)]
    pub transmission_factor: f32,
    pub transmission_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Specular {
    pub specular_factor: Option<f32>,
    pub specular_texture: Option<TextureInfo>,
    pub specular_color_factor: Option<[f32; 3]>,
    pub specular_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Clearcoat {
    #[serde(default)]
    pub clearcoat_factor: f32,
    pub clearcoat_texture: Option<TextureInfo>,
    #[serde(default)]
    pub clearcoat_roughness_factor: f32,
    pub clearcoat_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Sheen {
    #[serde(default)]
    pub sheen_color_factor: [f32; 3],
    pub sheen_color_texture: Option<TextureInfo>,
    #[serde(default)]
    pub sheen_roughness_factor: f32,
    pub sheen_roughness_texture: Option<TextureInfo>,
}

/// Of the way that came before `metallicRoughness`.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub diffuse_factor: Option<[f32; 4]>,
    pub diffuse_texture: Option<TextureInfo>,
    pub specular_factor: Option<[f32; 3]>,
    pub glossiness_factor: Option<f32>,
    pub specular_glossiness_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Ior {
    pub ior: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    pub emissive_strength: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: u32,
    /// Of a normal texture.
    pub scale: Option<f32>,
    /// Of an occlusion texture.
    pub strength: Option<f32>,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureTransform {
    #[serde(default)]
    pub offset: [f32; 2],
    #[serde(default)]
    pub rotation: f32,
    pub scale: Option<[f32; 2]>,
    pub tex_coord: Option<u32>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Texture {
    pub sampler: Option<usize>,
    source: Option<usize>,
    #[serde(default)]
    extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    webp: Option<TextureSource>,
    #[serde(rename = "KHR_texture_basisu")]
    basis: Option<TextureSource>,
}

#[derive(Debug, Deserialize)]
struct TextureSource {
    source: Option<usize>,
}

impl Texture {
    /// Its image, of `images` that there are. Where a file has one picture in several formats it is the one that lost
    /// the least: PNG or JPEG, then WebP, then Basis Universal.
    pub fn image(&self, images: usize) -> Option<usize> {
        let TextureExtensions { webp, basis } = &self.extensions;
        let given = [webp, basis].map(|extension| extension.as_ref().and_then(|extension| extension.source));
        [self.source, given[0], given[1]].into_iter().flatten().find(|&image| image < images)
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
    pub mime_type: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
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
