//! Faults of a document that loading by itself would not meet, or not name: each becomes a warning with its place.
//!
//! The rules are a choice from those of the Khronos glTF Validator, as tables where they are alike. Faults that make a
//! shown object unreadable are errors where they are met; nothing here stops a load.

use serde_json::{Map, Value};

use super::document::Document;
use crate::load::Warnings;
use crate::load::source::shorten;

/// Where an index stands, and of which array it is. `*` stands for any element or key.
const REFERENCES: &[(&str, &str)] = &[
    ("scene", "scenes"),
    ("scenes/*/nodes/*", "nodes"),
    ("nodes/*/children/*", "nodes"),
    ("nodes/*/camera", "cameras"),
    ("nodes/*/mesh", "meshes"),
    ("nodes/*/skin", "skins"),
    ("nodes/*/extensions/KHR_lights_punctual/light", "extensions/KHR_lights_punctual/lights"),
    ("meshes/*/primitives/*/attributes/*", "accessors"),
    ("meshes/*/primitives/*/targets/*/*", "accessors"),
    ("meshes/*/primitives/*/indices", "accessors"),
    ("meshes/*/primitives/*/material", "materials"),
    ("meshes/*/primitives/*/extensions/KHR_materials_variants/mappings/*/material", "materials"),
    (
        "meshes/*/primitives/*/extensions/KHR_materials_variants/mappings/*/variants/*",
        "extensions/KHR_materials_variants/variants",
    ),
    ("materials/*/normalTexture/index", "textures"),
    ("materials/*/occlusionTexture/index", "textures"),
    ("materials/*/emissiveTexture/index", "textures"),
    ("materials/*/pbrMetallicRoughness/baseColorTexture/index", "textures"),
    ("materials/*/pbrMetallicRoughness/metallicRoughnessTexture/index", "textures"),
    ("materials/*/extensions/*/*/index", "textures"),
    ("meshes/*/primitives/*/extensions/KHR_draco_mesh_compression/bufferView", "bufferViews"),
    ("textures/*/sampler", "samplers"),
    ("textures/*/source", "images"),
    ("textures/*/extensions/*/source", "images"),
    ("images/*/bufferView", "bufferViews"),
    ("skins/*/inverseBindMatrices", "accessors"),
    ("skins/*/skeleton", "nodes"),
    ("skins/*/joints/*", "nodes"),
    ("animations/*/samplers/*/input", "accessors"),
    ("animations/*/samplers/*/output", "accessors"),
    ("animations/*/channels/*/target/node", "nodes"),
    ("accessors/*/bufferView", "bufferViews"),
    ("accessors/*/sparse/indices/bufferView", "bufferViews"),
    ("accessors/*/sparse/values/bufferView", "bufferViews"),
    ("bufferViews/*/buffer", "buffers"),
];

/// Extensions that belong to one kind of object only.
const EXTENSION_PLACES: &[(&str, &[&str])] = &[
    ("EXT_mesh_gpu_instancing", &["nodes/*"]),
    ("EXT_meshopt_compression", &["bufferViews/*", "buffers/*"]),
    ("EXT_texture_webp", &["textures/*"]),
    ("KHR_animation_pointer", &["animations/*/channels/*/target"]),
    ("KHR_draco_mesh_compression", &["meshes/*/primitives/*"]),
    ("KHR_lights_punctual", &["", "nodes/*"]),
    ("KHR_materials_", &["materials/*"]),
    ("KHR_materials_variants", &["", "meshes/*/primitives/*"]),
    ("KHR_node_visibility", &["nodes/*"]),
    ("KHR_texture_basisu", &["textures/*"]),
];

/// `KHR_texture_transform` belongs to references to textures, which stand under names that end so.
const TEXTURE_INFO_SUFFIX: &str = "Texture";

/// Adds a warning for each fault found.
pub(super) fn lint(root: &Value, document: &Document, bin: bool, warnings: &mut Warnings) {
    let Value::Object(object) = root else { return };
    let used = used_extensions(object, warnings);
    Walk { root, used: &used, warnings }.value(root, &mut Vec::new());
    for (pattern, target) in REFERENCES {
        let count = lookup(root, target).and_then(Value::as_array).map_or(0, Vec::len) as u64;
        let segments: Vec<&str> = pattern.split('/').collect();
        matches(root, &segments, &mut String::new(), &mut |at, value| {
            if value.as_u64().is_none_or(|index| index >= count) {
                warnings.add(format!("{at}: {value} is not one of the {count} {target}"));
            }
        });
    }
    lint_storage(document, bin, warnings);
    lint_images(document, &used, warnings);
    lint_nodes(document, warnings);
    lint_primitives(document, warnings);
    lint_cameras(root, warnings);
}

fn used_extensions<'a>(object: &'a Map<String, Value>, warnings: &mut Warnings) -> Vec<&'a str> {
    for list in ["extensionsUsed", "extensionsRequired"] {
        let names: Vec<&str> = strings(object, list);
        for (index, name) in names.iter().enumerate().filter(|(index, name)| names[..*index].contains(name)) {
            warnings.add(format!("{list}[{index}]: {:?} is listed twice", shorten(name)));
        }
    }
    strings(object, "extensionsUsed")
}

fn strings<'a>(object: &'a Map<String, Value>, name: &str) -> Vec<&'a str> {
    object.get(name).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect()
}

fn lookup<'a>(root: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('/').try_fold(root, |value, key| value.get(key))
}

/// Calls `found` with every value that a pattern stands for. As deep as the pattern is long.
fn matches(value: &Value, pattern: &[&str], at: &mut String, found: &mut dyn FnMut(&str, &Value)) {
    let Some((first, rest)) = pattern.split_first() else { return found(at, value) };
    let before = at.len();
    let mut step = |name: &str, value: &Value| {
        push_name(at, name);
        matches(value, rest, at, found);
        at.truncate(before);
    };
    match value {
        Value::Array(values) if *first == "*" => {
            values.iter().enumerate().for_each(|(index, value)| step(&format!("[{index}]"), value));
        }
        Value::Object(object) if *first == "*" => object.iter().for_each(|(name, value)| step(name, value)),
        Value::Object(object) => {
            if let Some(value) = object.get(*first) {
                step(first, value);
            }
        }
        _ => {}
    }
}

fn push_name(at: &mut String, name: &str) {
    if !at.is_empty() && !name.starts_with('[') {
        at.push('.');
    }
    at.push_str(&shorten(name));
}

/// Looks at every value once. Recursion is as deep as the parser allows (128 levels).
struct Walk<'a> {
    root: &'a Value,
    used: &'a [&'a str],
    warnings: &'a mut Warnings,
}

impl<'a> Walk<'a> {
    fn value(&mut self, value: &'a Value, path: &mut Vec<String>) {
        match value {
            Value::Array(values) => {
                if values.is_empty() {
                    self.warnings.add(format!("{}: is an empty array", text(path)));
                }
                for (index, value) in values.iter().enumerate() {
                    path.push(format!("[{index}]"));
                    self.value(value, path);
                    path.pop();
                }
            }
            Value::Object(object) => {
                for (name, value) in object.iter().filter(|(name, _)| *name != "extras") {
                    if name == "extensions" {
                        self.extensions(value, path);
                    }
                    path.push(name.clone());
                    self.value(value, path);
                    path.pop();
                }
            }
            _ => {}
        }
    }

    fn extensions(&mut self, value: &Value, owner: &[String]) {
        for (name, extension) in value.as_object().into_iter().flatten() {
            let at = format!("{}.extensions.{}", text(owner), shorten(name));
            if !self.used.contains(&name.as_str()) {
                self.warnings.add(format!("{at}: is not declared in extensionsUsed"));
            }
            if !extension.is_object() {
                self.warnings.add(format!("{at}: is not an object"));
            }
            if !is_in_place(name, owner) {
                self.warnings.add(format!("{at}: does not belong here"));
            }
            let is_declared_at_root = lookup(self.root, &format!("extensions/{name}")).is_some();
            if matches!(name.as_str(), "KHR_lights_punctual" | "KHR_materials_variants") && !is_declared_at_root {
                self.warnings.add(format!("{at}: refers to an extension that the root does not have"));
            }
        }
    }
}

fn is_in_place(extension: &str, owner: &[String]) -> bool {
    if extension == "KHR_texture_transform" {
        return owner.last().is_some_and(|name| name.ends_with(TEXTURE_INFO_SUFFIX));
    }
    let mut rules = EXTENSION_PLACES
        .iter()
        .filter(|(name, _)| extension == *name || name.ends_with('_') && extension.starts_with(name));
    // The longest name is the most exact.
    let Some((_, places)) = rules.by_ref().max_by_key(|(name, _)| name.len()) else { return true };
    places.iter().any(|place| {
        let place: Vec<&str> = place.split('/').filter(|segment| !segment.is_empty()).collect();
        place.len() == owner.len() && place.iter().zip(owner).all(|(wanted, name)| *wanted == "*" || wanted == name)
    })
}

fn text(path: &[String]) -> String {
    let mut at = String::new();
    path.iter().for_each(|name| push_name(&mut at, name));
    if at.is_empty() { "root".into() } else { at }
}

/// Buffers, views, accessors, images: what does not fit.
fn lint_storage(document: &Document, bin: bool, warnings: &mut Warnings) {
    for (index, buffer) in document.buffers.iter().enumerate() {
        if buffer.uri.is_none() && buffer.extensions.fallback.is_none() && !(index == 0 && bin) {
            warnings.add(format!("buffers[{index}]: has neither a URI nor a GLB chunk"));
        }
    }
    for (index, view) in document.buffer_views.iter().enumerate() {
        let end = view.byte_offset.saturating_add(view.byte_length);
        if document.buffers.get(view.buffer).is_some_and(|buffer| end > buffer.byte_length) {
            warnings.add(format!("bufferViews[{index}]: ends at {end}, past its buffer"));
        }
        if view.byte_stride.is_some_and(|stride| stride % 4 != 0) {
            warnings.add(format!("bufferViews[{index}].byteStride: is not a multiple of 4"));
        }
    }
    let strided = |view: Option<usize>| {
        view.and_then(|view| document.buffer_views.get(view)).is_some_and(|view| view.byte_stride.is_some())
    };
    for (index, accessor) in document.accessors.iter().enumerate() {
        let (Some(component), Some(width)) =
            (super::accessor::component_bytes(accessor.component_type), super::accessor::width_of(&accessor.shape))
        else {
            warnings.add(format!("accessors[{index}]: is of unknown type"));
            continue;
        };
        let Some(view) = accessor.buffer_view.and_then(|view| document.buffer_views.get(view)) else { continue };
        if accessor.byte_offset % component != 0
            || (accessor.byte_offset.saturating_add(view.byte_offset)) % component != 0
        {
            warnings.add(format!("accessors[{index}]: is not aligned to its components of {component} bytes"));
        }
        let element = component * width as u64;
        let stride = view.byte_stride.unwrap_or(element);
        let needed = accessor
            .byte_offset
            .saturating_add(stride.saturating_mul(accessor.count.saturating_sub(1)))
            .saturating_add(element);
        if accessor.count > 0 && needed > view.byte_length && view.extensions.meshopt.is_none() {
            warnings.add(format!("accessors[{index}]: needs {needed} bytes of a view of {}", view.byte_length));
        }
    }
    for (index, image) in document.images.iter().enumerate() {
        match (&image.uri, image.buffer_view) {
            (None, None) => warnings.add(format!("images[{index}]: has neither uri nor bufferView")),
            (_, view) if strided(view) => warnings.add(format!("images[{index}].bufferView: has a byteStride")),
            _ => {}
        }
    }
    let accessor_view =
        |accessor: Option<usize>| accessor.and_then(|a| document.accessors.get(a)).and_then(|a| a.buffer_view);
    for (index, skin) in document.skins.iter().enumerate() {
        if strided(accessor_view(skin.inverse_bind_matrices)) {
            warnings.add(format!("skins[{index}].inverseBindMatrices: its view has a byteStride"));
        }
    }
    for (mesh, index, primitive) in primitives(document) {
        if strided(accessor_view(primitive.indices)) {
            warnings.add(format!("meshes[{mesh}].primitives[{index}].indices: its view has a byteStride"));
        }
    }
}

/// Formats of images, and the extensions that some of them need.
fn lint_images(document: &Document, used: &[&str], warnings: &mut Warnings) {
    for (index, image) in document.images.iter().enumerate() {
        let kind = image.mime_type.as_deref().unwrap_or("image/png");
        let needed = match kind {
            "image/png" | "image/jpeg" => continue,
            "image/webp" => "EXT_texture_webp",
            "image/ktx2" => "KHR_texture_basisu",
            _ => {
                warnings.add(format!("images[{index}]: {:?} is not PNG, JPEG, WebP or KTX2", shorten(kind)));
                continue;
            }
        };
        if !used.contains(&needed) {
            warnings.add(format!("images[{index}]: {kind:?} needs {needed}, which is not declared in extensionsUsed"));
        }
    }
}

fn primitives(document: &Document) -> impl Iterator<Item = (usize, usize, &super::document::Primitive)> {
    document.meshes.iter().enumerate().flat_map(|(mesh, source)| {
        source.primitives.iter().enumerate().map(move |(index, primitive)| (mesh, index, primitive))
    })
}

fn lint_nodes(document: &Document, warnings: &mut Warnings) {
    for (index, node) in document.nodes.iter().enumerate() {
        if node.mesh.is_none() && node.skin.is_some() {
            warnings.add(format!("nodes[{index}]: has a skin but no mesh"));
        }
        let Some(weights) = &node.weights else { continue };
        match node.mesh.and_then(|mesh| document.meshes.get(mesh)) {
            None => warnings.add(format!("nodes[{index}]: has weights but no mesh")),
            Some(mesh) => {
                let targets = mesh.primitives.iter().map(|primitive| primitive.targets.len()).max().unwrap_or(0);
                if weights.len() != targets {
                    warnings.add(format!("nodes[{index}].weights: {} weights for {targets} targets", weights.len()));
                }
            }
        }
    }
}

/// Attribute names, their counts, and formats that need an extension.
fn lint_primitives(document: &Document, warnings: &mut Warnings) {
    const FLOAT: u32 = 5126;
    let quantized = document.extensions_required.iter().any(|name| name == "KHR_mesh_quantization");
    for (mesh, index, primitive) in primitives(document) {
        let at = format!("meshes[{mesh}].primitives[{index}]");
        let count = |accessor: &usize| document.accessors.get(*accessor).map(|accessor| accessor.count);
        let expected = primitive.attributes.get("POSITION").and_then(count);
        for (name, accessor) in primitive.attributes.iter().chain(primitive.targets.iter().flatten()) {
            let short = shorten(name);
            if !is_semantic(name) {
                warnings.add(format!("{at}: attribute {short:?} is of no known name"));
            }
            let Some(accessor) = document.accessors.get(*accessor) else { continue };
            if expected.is_some_and(|expected| expected != accessor.count) {
                warnings.add(format!("{at}: {short} has {} elements, POSITION has another count", accessor.count));
            }
            if matches!(name.as_str(), "POSITION" | "NORMAL" | "TANGENT")
                && accessor.component_type != FLOAT
                && !quantized
            {
                warnings.add(format!("{at}.{short}: is not of floats, and KHR_mesh_quantization is not required"));
            }
        }
    }
}

/// The names of glTF 2.0, 3.7.2.1; an application's own begin with an underscore.
fn is_semantic(name: &str) -> bool {
    if matches!(name, "POSITION" | "NORMAL" | "TANGENT") || name.starts_with('_') {
        return true;
    }
    let numbered =
        name.split_once('_').filter(|(name, _)| matches!(*name, "TEXCOORD" | "COLOR" | "JOINTS" | "WEIGHTS"));
    let is_canonical = |digits: &str| digits.parse::<u32>().is_ok_and(|number| number.to_string() == digits);
    numbered.is_some_and(|(_, digits)| is_canonical(digits))
}

fn lint_cameras(root: &Value, warnings: &mut Warnings) {
    for (index, camera) in root.get("cameras").and_then(Value::as_array).into_iter().flatten().enumerate() {
        if camera.get("perspective").is_some() && camera.get("orthographic").is_some() {
            warnings.add(format!("cameras[{index}]: is both perspective and orthographic"));
        }
        for kind in ["perspective", "orthographic"] {
            let depth = |name: &str| camera.get(kind).and_then(|kind| kind.get(name)).and_then(Value::as_f64);
            if let (Some(near), Some(far)) = (depth("znear"), depth("zfar"))
                && far <= near
            {
                warnings.add(format!("cameras[{index}].{kind}: zfar is not beyond znear"));
            }
        }
    }
}
