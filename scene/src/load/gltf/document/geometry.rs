//! Meshes, and how their numbers lie in buffers.

use serde::Deserialize;

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    pub weights: Option<Vec<f32>>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Primitive {
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
pub(in crate::load::gltf) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Option<Variants>,
}

/// Which material a primitive has in which variants.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::load::gltf) struct Variants {
    pub mappings: Vec<VariantMaterial>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct VariantMaterial {
    pub material: usize,
    #[serde(default)]
    pub variants: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Variant {
    pub name: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Draco {
    pub buffer_view: usize,
    /// By name, the id that the compressed stream has for it.
    pub attributes: std::collections::BTreeMap<String, u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Accessor {
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
pub(in crate::load::gltf) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct BufferView {
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
pub(in crate::load::gltf) struct BufferViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub meshopt: Option<Meshopt>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Meshopt {
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
pub(in crate::load::gltf) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
    #[serde(default)]
    pub extensions: BufferExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::load::gltf) struct BufferExtensions {
    /// Present where the buffer is only for readers without the extension, and may have no data.
    #[serde(rename = "EXT_meshopt_compression")]
    pub fallback: Option<Fallback>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Fallback {}
