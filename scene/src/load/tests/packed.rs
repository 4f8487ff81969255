//! Files with compressed meshes and images: what they mean, and what damaged ones do.
//!
//! The files in `data` were made for these tests. `sheet-*.glb` is a wavy sheet of 9 x 9 vertices with normals, texture
//! coordinates and colours, compressed by the two methods of Draco. `quadrants*` is a picture of 32 x 24 pixels: red, green,
//! below them blue and half transparent white.

use serde_json::json;

use super::build::{Builder, TRIANGLE};
use super::{load_gltf, load_with, refusal};
use crate::load::LoadLimits;
use crate::{Scene, Texture};

const EDGEBREAKER: &[u8] = include_bytes!("data/sheet-edgebreaker.glb");
const SEQUENTIAL: &[u8] = include_bytes!("data/sheet-sequential.glb");
const ETC1S: &[u8] = include_bytes!("data/quadrants-etc1s.ktx2");
const UASTC: &[u8] = include_bytes!("data/quadrants-uastc.ktx2");
const UASTC_ZSTD: &[u8] = include_bytes!("data/quadrants-uastc-zstd.ktx2");
const WEBP: &[u8] = include_bytes!("data/quadrants.webp");
const WEBP_LOSSY: &[u8] = include_bytes!("data/quadrants-lossy.webp");

/// A triangle with a texture of one image, which an extension refers to.
fn textured(image: &[u8], mime: &str, extension: &str) -> Builder {
    let mut builder = Builder::of_positions(&TRIANGLE);
    let uvs = builder.floats(&[0.0; 6], "VEC2");
    builder.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    builder.json["textures"] = json!([{"extensions": {extension: {"source": 0}}}]);
    let view = builder.view(image);
    builder.json["images"] = json!([{"bufferView": view, "mimeType": mime}]);
    builder.json["extensionsUsed"] = json!([extension]);
    builder.json["extensionsRequired"] = json!([extension]);
    builder
}

fn texture(image: &[u8], mime: &str, extension: &str) -> Texture {
    let scene = load_gltf(&textured(image, mime, extension).glb()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene.textures[0].clone()
}

/// Compares the middles of the quadrants.
fn assert_quadrants(texture: &Texture, tolerance: u8) {
    assert_eq!((texture.width_px, texture.height_px), (32, 24));
    let expected = [
        (8, 6, [255, 0, 0, 255]),
        (24, 6, [0, 255, 0, 255]),
        (8, 18, [0, 0, 255, 255]),
        (24, 18, [255, 255, 255, 128]),
    ];
    for (x, y, colour) in expected {
        let at = (y * 32 + x) * 4;
        let found = &texture.rgba[at..at + 4];
        let off = found.iter().zip(colour).map(|(found, expected): (&u8, u8)| found.abs_diff(expected)).max();
        assert!(off <= Some(tolerance), "{found:?} is not {colour:?} at {x}, {y}");
    }
}

#[test]
fn webp_and_ktx2_pictures_are_textures() {
    assert_quadrants(&texture(WEBP, "image/webp", "EXT_texture_webp"), 0);
    // Each of these formats keeps colours of a block in 5 to 8 bits: off by half of a step of 5 bits.
    let step = 255 / 31 / 2;
    assert_quadrants(&texture(WEBP_LOSSY, "image/webp", "EXT_texture_webp"), step);
    for file in [ETC1S, UASTC, UASTC_ZSTD] {
        assert_quadrants(&texture(file, "image/ktx2", "KHR_texture_basisu"), step);
    }
}

#[test]
fn of_a_picture_in_several_formats_the_plain_one_is_taken() {
    let mut builder = textured(ETC1S, "image/ktx2", "KHR_texture_basisu");
    let view = builder.view(WEBP);
    builder.push("images", json!({"bufferView": view, "mimeType": "image/webp"}));
    builder.json["extensionsUsed"] = json!(["KHR_texture_basisu", "EXT_texture_webp"]);
    builder.json["textures"][0]["source"] = json!(1);
    let scene = load_gltf(&builder.glb()).unwrap();
    assert_quadrants(&scene.textures[0], 0);
}

#[test]
fn a_picture_that_claims_more_than_it_is_gets_no_memory() {
    let changed = |file: &[u8], at: usize, value: u32| {
        let mut file = file.to_vec();
        file[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let scene = load_gltf(&textured(&file, "image/ktx2", "KHR_texture_basisu").glb()).unwrap();
        assert!(scene.textures.is_empty());
        scene.warnings.join("; ")
    };
    for (at, value, why) in [
        (20, 60_000, "more than 16384 on a side"),
        (32, 1_000_000, "not one plain picture"),
        (36, 6, "not one plain picture"),
        (40, 1_000_000, "levels"),
        (96, 2_000_000_000, "larger than its picture"),
        (100, 1, "larger than its picture"),
        (44, 3, "damaged, or not of Basis Universal"),
    ] {
        let warnings = changed(UASTC_ZSTD, at, value);
        assert!(warnings.contains(why) && warnings.contains("images[0] is left out"), "{warnings}");
    }
    let warnings = changed(UASTC, 20, 16_000);
    assert!(warnings.contains("shorter than its picture"), "{warnings}");
}

/// Where the sheet's vertices are, by their texture coordinates; colours and normals follow them.
fn assert_sheet(scene: &Scene) {
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!((scene.triangle_count(), scene.meshes[0].vertices.len()), (128, 81));
    let place = scene.at(0.0).world_from_mesh[0];
    // Positions have 14 bits, normals 10: a step of each.
    let (step, angle) = (1.0 / f64::from(1 << 14), 2.0 / f64::from(1 << 10));
    for vertex in &scene.meshes[0].vertices {
        let found = place.transform_point3(glam::DVec3::from(vertex.position.map(f64::from)));
        let column = found.x * 8.0;
        assert!((found.y - column.round().sin() * 0.1).abs() < 2.0 * step, "{found}");
        let slope = column.round().cos() * 0.8;
        let normal = glam::DVec3::new(-slope, 1.0, 0.0).normalize();
        assert!((glam::DVec3::from(vertex.normal.map(f64::from)) - normal).length() < 2.0 * angle, "{vertex:?}");
        // Of 8 bits.
        let red = (found.x * 255.0).round();
        assert!((f64::from(vertex.colour[0]) - red).abs() <= 1.0 && vertex.colour[3] == 255, "{vertex:?}");
    }
}

#[test]
fn draco_meshes_of_both_methods_are_read() {
    for file in [EDGEBREAKER, SEQUENTIAL] {
        assert_sheet(&load_gltf(file).unwrap());
    }
}

/// A copy of a GLB file with its JSON text changed to one of the same length.
fn edited(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = file.windows(from.len()).position(|window| window == from.as_bytes()).expect("it is there");
    let mut file = file.to_vec();
    file[at..at + from.len()].copy_from_slice(format!("{to:<width$}", width = from.len()).as_bytes());
    file
}

#[test]
fn a_draco_stream_decodes_to_no_more_than_is_declared() {
    let error = refusal(load_gltf(&edited(EDGEBREAKER, "\"count\":384", "\"count\":381")));
    assert!(error.contains("KHR_draco_mesh_compression") && error.contains("ceiling of 127"), "{error}");
    let error = refusal(load_gltf(&edited(EDGEBREAKER, "\"NORMAL\":1,", "\"NORMAL\":9,")));
    assert!(error.contains("no attribute 9"), "{error}");
    let limits = LoadLimits { triangles: 127, ..LoadLimits::default() };
    let few = load_with(|bytes, request| super::super::gltf::load(bytes.to_vec(), request), EDGEBREAKER, &limits);
    assert!(refusal(few).contains("indices: 384 is more than the limit"));
}

#[test]
fn positions_beside_a_draco_stream_must_be_as_many_as_its_vertices() {
    let beside = edited(EDGEBREAKER, "\"POSITION\":0", "\"POSITIOM\":0");
    for count in ["80", "82"] {
        let error = refusal(load_gltf(&edited(&beside, "\"count\":81", &format!("\"count\":{count}"))));
        assert!(error.contains(&format!("the stream has 81 vertices, POSITION has {count}")), "{error}");
    }
}

/// How many damaged copies of each file are tried: `VANTAGE_DAMAGED`, or so many that it takes a second.
fn damaged_copies() -> u64 {
    std::env::var("VANTAGE_DAMAGED").ok().and_then(|count| count.parse().ok()).unwrap_or(100)
}

/// Numbers that look random and are the same every time (xorshift64, Marsaglia 2003).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

/// Cut short, or up to eight bytes changed, half of them among the first 128, where headers are.
fn damaged(file: &[u8], seed: u64) -> Vec<u8> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let mut copy = file.to_vec();
    if random.below(4) == 0 {
        copy.truncate(random.below(file.len()));
        return copy;
    }
    for _ in 0..=random.below(8) {
        let end = if random.below(2) == 0 { copy.len().min(128) } else { copy.len() };
        let at = random.below(end);
        copy[at] = match random.below(3) {
            0 => 0xFF,
            1 => copy[at] ^ (1 << random.below(8)),
            _ => random.below(256) as u8,
        };
    }
    copy
}

/// The compressed stream of a GLB file that has nothing else in its second chunk.
fn stream(file: &[u8]) -> (&[u8], &[u8]) {
    let at = file.windows(5).position(|window| window == b"DRACO").expect("the stream begins so");
    file.split_at(at)
}

#[test]
fn damaged_draco_streams_do_no_harm() {
    for file in [EDGEBREAKER, SEQUENTIAL] {
        let (head, body) = stream(file);
        for seed in 0..damaged_copies() {
            let mut bytes = damaged(body, seed);
            bytes.resize(body.len(), 0);
            match load_gltf(&[head, &bytes].concat()) {
                Ok(scene) => assert!(scene.triangle_count() <= 128),
                Err(error) => assert!(error.to_string().contains("meshes[0].primitives[0]"), "{seed}: {error}"),
            }
        }
    }
}

#[test]
fn damaged_pictures_do_no_harm() {
    let files = [
        (ETC1S, "image/ktx2"),
        (UASTC, "image/ktx2"),
        (UASTC_ZSTD, "image/ktx2"),
        (WEBP, "image/webp"),
        (WEBP_LOSSY, "image/webp"),
    ];
    for (file, mime) in files {
        let extension = if mime == "image/webp" { "EXT_texture_webp" } else { "KHR_texture_basisu" };
        for seed in 0..damaged_copies() {
            let scene = load_gltf(&textured(&damaged(file, seed), mime, extension).glb()).unwrap();
            let told = scene.warnings.iter().any(|warning| warning.contains("images[0] is left out"));
            assert!(told != (scene.textures.len() == 1), "{seed}: {:?}", scene.warnings);
        }
    }
}
