//! glTF 2.0 and GLB.
//!
//! One pass from bytes to scene: the container is taken apart and its JSON read ([`document`]); buffers are read and
//! decompressed ([`buffers`], [`meshopt`]); nodes become a forest ([`hierarchy`]); the primitives that the shown nodes
//! need are built in parallel ([`primitive`]), images decoded in parallel ([`images`], [`material`]); [`assemble`] makes
//! an instance of each primitive of each node; [`motion`] evaluates it over time ([`clip`], [`deform`]).
//!
//! Extensions: EXT_mesh_gpu_instancing, EXT_meshopt_compression, EXT_texture_webp, KHR_draco_mesh_compression ([`draco`]),
//! KHR_lights_punctual, KHR_materials_clearcoat, KHR_materials_emissive_strength, KHR_materials_ior, KHR_materials_pbrSpecularGlossiness,
//! KHR_materials_sheen, KHR_materials_specular, KHR_materials_transmission,
//! KHR_materials_unlit, KHR_materials_variants ([`choice`]), KHR_mesh_quantization, KHR_texture_basisu, KHR_texture_transform.
//!
//! Lights with an area: a point or spot light whose `extras` hold `"radius": R` is a disc, one with `"size": [W, H]` a rectangle, in metres, in the
//! xy plane of its node; and a mesh of two triangles that form a rectangle and emit light is a light of its size, which sends the more light
//! the more it is seen from the front (with the square of the cosine, from both sides where its material has two).
//!
//! Cameras that bend, split, merge or look past a silhouette: `"graph_camera"` or `"single_pole"` in the `extras` of a node with a camera, in the
//! node's space ([`named_camera`]).
//!
//! What transmits is thin: light passes it straight on, whatever its thickness (`KHR_materials_volume`).
//!
//! Other extensions are ignored where the file merely uses them, and named in a warning where it requires them.

mod accessor;
mod assemble;
mod attributes;
mod buffers;
mod choice;
mod clip;
mod container;
mod deform;
mod document;
mod draco;
mod hierarchy;
mod images;
mod instancing;
mod light;
mod lint;
mod material;
mod merge;
mod meshopt;
mod motion;
mod named_camera;
mod panel;
mod primitive;
mod primitives;

use super::{LoadError, Request, Stage, Warnings};
use crate::Scene;

pub(super) use container::GLB_MAGIC;

use accessor::Accessors;
use buffers::{Buffers, UriReader};
use container::Container;
use document::Document;

/// What files may require.
const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Loads a `.gltf` or `.glb` file.
pub(super) fn load(bytes: Vec<u8>, request: &Request<'_>) -> Result<Scene, LoadError> {
    let mut warnings = Warnings::default();
    let container = Container::of(&bytes, &mut warnings)?;
    let root = container::parse_json(container.json, request.limits.json_values)?;
    let mut document = Document::read(&root)?;
    check_version(&document)?;
    warn_of_extensions(&document, &mut warnings);
    lint::lint(&root, &document, container.bin.is_some(), &mut warnings);
    drop(root);
    document.choose(request.choice)?;
    document.forget_unknown_meshes();
    document.place_loose_meshes(&mut warnings);
    let mut uris = UriReader::new(&request.folder, request.limits.file_bytes);
    let buffers = Buffers::read(&document, container.bin, &mut uris, request.limits, &mut warnings)?;
    request.report(Stage::Read, 1, 1);
    let images = images::read(&document, &buffers, &mut uris, request, &mut warnings);
    let materials = material::read(&document, images, &mut warnings);
    let accessors = Accessors::new(&document, &buffers);
    assemble::scene(&document, accessors, materials, request, warnings)
}

/// `minVersion` counts where there is one: a file of version 2.1 may be readable as 2.0.
fn check_version(document: &Document) -> Result<(), LoadError> {
    let readable = match &document.min_version {
        Some(needed) => needed == "2.0",
        None => document.version.starts_with("2."),
    };
    if readable && document.version.starts_with("2.") {
        return Ok(());
    }
    let needed = document.min_version.as_ref().unwrap_or(&document.version);
    Err(LoadError::Unsupported {
        feature: format!("glTF version {:?}", super::source::shorten(needed)),
        hint: "only version \"2.0\" is read".into(),
    })
}

/// What a file requires and is not read here: the rest is shown, if there is any.
fn warn_of_extensions(document: &Document, warnings: &mut Warnings) {
    for name in document.extensions_required.iter().filter(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str())) {
        let name = super::source::shorten(name);
        warnings.add(format!("the file requires {name}, which is not supported: it is shown without"));
    }
}
