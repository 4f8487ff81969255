//! Scene files of every format.

use std::io::Cursor;

use image::{ImageFormat, Rgb32FImage, RgbaImage};
use serde_json::{Value, json};

use super::glb::Builder;

const SHEETS: [(&str, &[u8]); 2] = [
    ("draco-edgebreaker", include_bytes!("../../../scene/src/load/tests/data/sheet-edgebreaker.glb")),
    ("draco-sequential", include_bytes!("../../../scene/src/load/tests/data/sheet-sequential.glb")),
];
const PICTURES: [(&str, &str, &[u8]); 4] = [
    ("webp", "EXT_texture_webp", include_bytes!("../../../scene/src/load/tests/data/quadrants.webp")),
    ("webp-lossy", "EXT_texture_webp", include_bytes!("../../../scene/src/load/tests/data/quadrants-lossy.webp")),
    ("etc1s", "KHR_texture_basisu", include_bytes!("../../../scene/src/load/tests/data/quadrants-etc1s.ktx2")),
    (
        "uastc-zstd",
        "KHR_texture_basisu",
        include_bytes!("../../../scene/src/load/tests/data/quadrants-uastc-zstd.ktx2"),
    ),
];

/// A picture of 8 x 8 pixels.
fn picture(format: ImageFormat) -> Vec<u8> {
    let image = RgbaImage::from_fn(8, 8, |x, y| image::Rgba([x as u8 * 30, y as u8 * 30, 90, 255 - x as u8]));
    let mut bytes = Cursor::new(Vec::new());
    let written = match format {
        ImageFormat::Jpeg => image::DynamicImage::from(image).to_rgb8().write_to(&mut bytes, format),
        _ => image.write_to(&mut bytes, format),
    };
    written.expect("memory takes pictures");
    bytes.into_inner()
}

fn textured(picture: &[u8], extension: Option<&str>) -> Builder {
    let mut builder = Builder::quad();
    let view = builder.view(picture);
    let mime = if extension == Some("KHR_texture_basisu") { "image/ktx2" } else { "image/png" };
    builder.json["images"] = json!([{"bufferView": view, "mimeType": mime}]);
    builder.json["textures"] = match extension {
        Some(extension) => json!([{"extensions": {extension: {"source": 0}}}]),
        None => json!([{"source": 0, "sampler": 0}]),
    };
    builder.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
    builder.json["materials"] = json!([{"alphaMode": "MASK", "alphaCutoff": 0.4, "pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}}, "normalTexture": {"index": 0}}]);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder
}

fn extended() -> Builder {
    let mut builder = Builder::quad();
    let extensions = json!({
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.5}, "KHR_materials_emissive_strength": {"emissiveStrength": 4.0},
        "KHR_materials_ior": {"ior": 1.4}, "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3]},
        "KHR_materials_specular": {"specularFactor": 0.5}, "KHR_materials_transmission": {"transmissionFactor": 0.9},
    });
    builder.json["materials"] = json!([{"emissiveFactor": [1, 1, 1], "extensions": extensions}, {"extensions": {
        "KHR_materials_unlit": {}, "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 0, 0, 1], "glossinessFactor": 0.3}}}]);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}});
    let lights = json!([{"type": "spot", "intensity": 40, "range": 9, "spot": {"outerConeAngle": 0.6}, "extras": {"radius": 0.2}},
        {"type": "directional", "color": [1, 0.5, 0]}, {"type": "point", "extras": {"size": [0.5, 2]}}]);
    builder.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": lights}, "KHR_materials_variants": {"variants": [{"name": "red"}]}});
    builder.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]);
    let written = json!({"graph_camera": {"fov_y_deg": 60, "size_px": [64, 36], "depth_m": 9, "operations": [{"bend": {
        "of": "root", "at": {"after_m": 3}, "into": {"name": "on", "direction": [0, 1, -1], "depth_m": 3}}}]}});
    builder.json["nodes"] = json!([
        {"mesh": 0, "children": [1, 2, 3], "translation": [1, 2, 3], "rotation": [0, 0.6, 0, 0.8], "scale": [1, -2, 0.5]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"camera": 0, "name": "corner", "extras": written},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,5,0,1]},
    ]);
    builder
}

fn instanced() -> Builder {
    let mut builder = Builder::quad();
    let places = builder.floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 5.0], "VEC3");
    builder.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let sparse_values = builder.view(&1.0_f32.to_le_bytes().repeat(3));
    let sparse_indices = builder.view(&[1, 0]);
    builder.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": sparse_indices, "componentType": 5123}, "values": {"bufferView": sparse_values}});
    builder.json["meshes"][0]["primitives"].as_array_mut().expect("there are some").extend([
        json!({"attributes": {"POSITION": 0}, "mode": 0}),
        json!({"attributes": {"POSITION": 0}, "mode": 3, "indices": 3}),
        json!({"attributes": {"POSITION": 0}, "mode": 5}),
        json!({"attributes": {"POSITION": 0}, "mode": 6}),
    ]);
    builder
}

fn skinned() -> Builder {
    let mut builder = Builder::quad();
    let joints = builder.accessor(&[0, 1, 0, 0].repeat(4), 5121, "VEC4", 4);
    let weights = builder.floats(&[0.75, 0.25, 0.0, 0.0].repeat(4), "VEC4");
    let colours = builder.accessor(&[255, 128, 0, 255].repeat(4), 5121, "VEC4", 4);
    builder.json["accessors"][colours]["normalized"] = true.into();
    let attributes = [("JOINTS_0", joints), ("WEIGHTS_0", weights), ("COLOR_0", colours)];
    attributes.into_iter().for_each(|(name, at)| builder.attribute(name, at));
    let identity: Vec<f32> = (0..16).map(|at| if at % 5 == 0 { 1.0 } else { 0.0 }).collect();
    let inverse = builder.floats(&identity.repeat(2), "MAT4");
    builder.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]);
    builder.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [0, 1, 0]}]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1]);
    builder.animate("rotation", "CUBICSPLINE", &[0.0, 0.0, 0.0, 1.0].repeat(6), "VEC4");
    builder.json["animations"][0]["channels"][0]["target"]["node"] = json!(2);
    builder
}

fn morphed() -> Builder {
    let mut builder = Builder::quad();
    let target = builder.floats(&[0.5; 12], "VEC3");
    builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target, "NORMAL": target}]);
    builder.json["meshes"][0]["weights"] = json!([0.5]);
    builder.animate("weights", "LINEAR", &[0.0, 1.0], "SCALAR");
    builder.animate("translation", "STEP", &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0], "VEC3");
    builder
}

/// As text, with a buffer beside it and one within.
fn text() -> Value {
    json!({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {
            "KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1.0, "scale": [2, 3], "texCoord": 0}}}}}],
        "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}], "images": [{"uri": "image.webp"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [{"buffer": 1, "byteLength": 36}],
        "buffers": [{"byteLength": 64, "uri": "buffer.bin"},
            {"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})
}

/// Positions in [meshopt's](https://github.com/zeux/meshoptimizer) stored form: an attribute stream of zeros.
fn packed() -> Builder {
    let mut builder = Builder::quad();
    // A head, a block of 16-byte groups that say nothing changes, and the first vertex as the tail.
    let stream = [&[0xa0][..], &[0; 12], &[0; 32]].concat();
    let view = builder.view(&stream);
    let extension = json!({"buffer": 0, "byteOffset": builder.json["bufferViews"][view]["byteOffset"], "byteLength": stream.len(),
        "byteStride": 12, "count": 4, "mode": "ATTRIBUTES", "filter": "NONE"});
    let place = builder.push(
        "bufferViews",
        json!({"buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12,
        "extensions": {"EXT_meshopt_compression": extension}}),
    );
    builder.json["accessors"][1]["bufferView"] = place.into();
    builder.json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    builder
}

pub fn gltf() -> Vec<(String, Vec<u8>)> {
    let mut seeds: Vec<(String, Vec<u8>)> = SHEETS.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).into();
    seeds.extend(PICTURES.map(|(name, extension, bytes)| (name.to_owned(), textured(bytes, Some(extension)).glb())));
    let pictures = [("png", ImageFormat::Png), ("jpeg", ImageFormat::Jpeg)];
    seeds.extend(pictures.map(|(name, format)| (name.to_owned(), textured(&picture(format), None).glb())));
    let built = [
        ("extended", extended()),
        ("instanced", instanced()),
        ("skinned", skinned()),
        ("morphed", morphed()),
        ("packed", packed()),
    ];
    seeds.extend(built.map(|(name, builder)| (name.to_owned(), builder.glb())));
    seeds.push(("text".to_owned(), text().to_string().into_bytes()));
    seeds
}

pub fn mesh_files() -> Vec<(String, Vec<u8>)> {
    let obj = b"mtllib scene.mtl\no a\nv 0 0 0\nv 1 0 0 1 0.5 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl b\ns 1\nf 1/1/1 2/1/1 3//1 -1\ng c\nf 1 2 4\nl 1 2 3\np 4\n\0newmtl b\nKd 0.5 0.5 1\nKe 1 0 0\nNs 40\nNi 1.4\nd 0.5\nTr 0.5\nmap_Kd none.png\n";
    let ply = b"ply\nformat binary_little_endian 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\0\0\0\0\0\0\0\0\0\0\0\0\x01\0\0\x80\x3f\0\0\0\0\0\0\0\0\x02\0\0\0\0\0\0\x80\x3f\0\0\0\0\x03\x03\0\0\0\0\x01\0\0\0\x02\0\0\0";
    let cloud = b"ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 0 0 0 1 0\n1e9 0 -7 1 0 0\n8 9 10 0 0 0\n";
    let big = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar ushort vertex_index\nend_header\n\0\0\0\0\0\0\0\0\0\0\0\0\x3f\x80\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x3f\x80\0\0\0\0\0\0\x03\0\0\0\x01\0\x02";
    let facet = |at: f32| {
        [0.0, 0.0, 1.0, at, 0.0, 0.0, at + 1.0, 0.0, 0.0, at, 1.0, 0.0].map(f32::to_le_bytes).as_flattened().to_vec()
    };
    let stl = [vec![b' '; 80], 2_u32.to_le_bytes().to_vec(), facet(0.0), vec![0; 2], facet(2.0), vec![0; 2]].concat();
    let stl_text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid a\n";
    let hdr =
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n\x80\x80\x80\x81\x10\x20\x30\x78\0\0\0\0\xff\xff\xff\xff";
    let exr = |width: u32| {
        let mut bytes = Cursor::new(Vec::new());
        let pixels = Rgb32FImage::from_fn(width, 2, |x, y| image::Rgb([x as f32, y as f32 * 1e6, 0.5]));
        image::DynamicImage::from(pixels).write_to(&mut bytes, ImageFormat::OpenExr).expect("memory takes pictures");
        bytes.into_inner()
    };
    let seeds: [(&str, u8, &[u8]); 9] = [
        ("obj", 0, obj),
        ("ply", 1, ply),
        ("ply-cloud", 1, cloud),
        ("ply-big", 4, big),
        ("stl", 2, &stl),
        ("stl-text", 2, stl_text),
        ("hdr", 3, hdr),
        ("exr", 3, &exr(2)),
        ("exr-wide", 3, &exr(40)),
    ];
    seeds.map(|(name, kind, bytes)| (name.to_owned(), [&[kind], bytes].concat())).into()
}
