//! Materials, and the textures that they are drawn with.
//!
//! A mesh has the texture coordinates of its material's first texture, and where the material needs them a second set, those of the first texture whose
//! coordinates do not follow from these. Every texture of the material says how its own follow from one of both. A texture by a third set of
//! coordinates is left out, with a warning.

use std::collections::HashMap;

use glam::{Affine2, Mat2, Vec2};
use image::RgbaImage;

use super::document::{self, Document, Sampler, TextureInfo, TextureTransform};
use super::images::image_of;
use crate::load::Warnings;
use crate::load::source::shorten;
use crate::model::{Bumps, Map, Quantity, SAME_UV, UvMap, UvSet, Wrap};
use crate::{Material, Texture};

/// Where a blended material is not seen through, as in shadows, it is cut out at this opacity; it is also the default of masked ones (glTF 2.0, 5.19.9).
const DEFAULT_CUTOFF: f32 = 0.5;

/// Where the sets of coordinates of a material come from; none where it needs no such set.
pub(super) type UvSources = [Option<UvSource>; 2];

/// Where a mesh's texture coordinates come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvSource {
    /// The `TEXCOORD_n` set.
    pub set: u32,
    transform: Option<TextureTransform>,
}

impl UvSource {
    fn of(info: &TextureInfo) -> UvSource {
        let transform = info.extensions.transform;
        UvSource { set: transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord), transform }
    }

    /// `KHR_texture_transform`: scale, then rotation about the image's upper left, then offset.
    fn map(&self) -> Affine2 {
        let Some(transform) = &self.transform else { return Affine2::IDENTITY };
        let (sin, cos) = transform.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let scale = Mat2::from_diagonal(Vec2::from(transform.scale.unwrap_or([1.0; 2])));
        Affine2 { matrix2: turn * scale, translation: Vec2::from(transform.offset) }
    }

    /// The coordinates that vertices get, of those in the file.
    pub fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        if self.transform.is_some() { self.map().transform_point2(Vec2::from(uv)).to_array() } else { uv }
    }

    /// From the coordinates that vertices get to those of `other`; `None` where they do not follow from them.
    fn to(self, other: UvSource) -> Option<UvMap> {
        if self == other {
            return Some(SAME_UV);
        }
        let own = self.map();
        // A texture of which the vertices say one line only tells nothing of the others. A determinant is the difference of two products, which round by 2^-24 each
        // of what they are, the axes' lengths multiplied at most: less than 2^-23 of that is rounding. Quantized coordinates come with scales of 1/65535.
        let axes = own.matrix2.x_axis.length() * own.matrix2.y_axis.length();
        let followed = self.set == other.set && own.matrix2.determinant().abs() > f32::EPSILON * axes;
        let map = followed.then(|| other.map() * own.inverse()).filter(|map| map.is_finite())?;
        let [x, y] = [map.matrix2.row(0), map.matrix2.row(1)];
        Some([[x.x, x.y, map.translation.x], [y.x, y.y, map.translation.y]])
    }
}

/// All materials of a document.
pub(super) struct Materials {
    /// The file's, then the default one, which primitives without a material have.
    pub materials: Vec<Material>,
    /// Of the scene.
    pub textures: Vec<Texture>,
    /// By material: of its first and its second set.
    pub uv_sources: Vec<UvSources>,
}

impl Materials {
    fn add(&mut self, material: Material, uv_sources: UvSources) {
        self.materials.push(material);
        self.uv_sources.push(uv_sources);
    }
}

/// Makes the scene's materials from the document's and the images that they need.
pub(super) fn read(document: &Document, images: Vec<Option<RgbaImage>>, warnings: &mut Warnings) -> Materials {
    let mut textures = Textures { document, images, textures: Vec::new(), known: HashMap::new() };
    let mut all = Materials { materials: Vec::new(), textures: Vec::new(), uv_sources: Vec::new() };
    let shown = document.shown_materials();
    for (index, material) in document.materials.iter().enumerate() {
        if !shown.contains(&index) {
            all.add(Material::default(), [None; 2]);
            continue;
        }
        let name = material.name.as_deref().map_or(String::new(), |name| format!(" {:?}", shorten(name)));
        let at = format!("materials[{index}]{name}");
        let textured = textured(material, &mut textures, &at, warnings);
        let numbers = numbers(material, &at, warnings);
        let Textured { uv_sources, base, bumps, maps } = textured;
        all.add(Material { texture: base, bumps, maps, ..numbers }, uv_sources);
    }
    all.add(Material { metallic: 1.0, ..Material::default() }, [None; 2]);
    all.textures = textures.textures;
    all
}

/// What a material's textures are for.
#[derive(Default)]
struct Textured {
    uv_sources: UvSources,
    base: Option<u32>,
    bumps: Option<Bumps>,
    maps: Vec<Map>,
}

fn textured(material: &document::Material, textures: &mut Textures<'_>, at: &str, warnings: &mut Warnings) -> Textured {
    let mut textured = Textured::default();
    let base = material.pbr_metallic_roughness.base_color_texture.as_ref();
    let glossy = material.extensions.specular_glossiness.as_ref();
    let base = base.or(glossy.and_then(|glossy| glossy.diffuse_texture.as_ref()));
    for (quantity, info) in material.textures() {
        let is_base = base.is_some_and(|base| std::ptr::eq(base, info));
        let what = quantity.map_or(if is_base { "base colour" } else { "normal" }, name_of);
        let Some(texture) = textures.of(info, what, at, warnings) else { continue };
        let own = UvSource::of(info);
        let Some((uv_set, from_uv)) = set_of(&mut textured.uv_sources, own) else {
            warnings.add(format!("{at}: drawn without its {what} texture, which has a third set of coordinates"));
            continue;
        };
        match quantity {
            None if is_base => textured.base = Some(texture),
            None => {
                let scale = info.scale.filter(|scale| scale.is_finite()).unwrap_or(1.0);
                textured.bumps = Some(Bumps { texture, uv_set, from_uv, scale });
            }
            Some(quantity) => {
                let strength = info.strength.map_or(1.0, unit);
                textured.maps.push(Map { quantity, texture, uv_set, from_uv, strength });
            }
        }
    }
    textured
}

/// The set whose coordinates those of a texture follow from, and how; the first that is free becomes its own.
fn set_of(sources: &mut UvSources, own: UvSource) -> Option<(UvSet, UvMap)> {
    [UvSet::First, UvSet::Second].into_iter().zip(sources).find_map(|(set, source)| {
        let from_uv = source.get_or_insert(own).to(own)?;
        Some((set, from_uv))
    })
}

fn name_of(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::MetallicRoughness => "metallic-roughness",
        Quantity::Occlusion => "occlusion",
        Quantity::Emissive => "emissive",
        Quantity::Transmission => "transmission",
        Quantity::Specular => "specular",
        Quantity::SpecularColour => "specular colour",
        Quantity::Clearcoat => "clear coat",
        Quantity::ClearcoatRoughness => "clear coat's roughness",
        Quantity::Sheen => "sheen",
        Quantity::SheenRoughness => "sheen's roughness",
    }
}

/// What a material is where no texture says more.
fn numbers(material: &document::Material, at: &str, warnings: &mut Warnings) -> Material {
    let (pbr, more) = (&material.pbr_metallic_roughness, &material.extensions);
    for name in more.not_drawn() {
        warnings.add(format!("{at}: drawn without its {name}"));
    }
    let strength = more.emissive_strength.as_ref().and_then(|e| e.emissive_strength).unwrap_or(1.0);
    let (clearcoat, sheen, specular) = (more.clearcoat.as_ref(), more.sheen.as_ref(), more.specular.as_ref());
    let numbers = Material {
        name: material.name.clone().unwrap_or_default(),
        base_colour: pbr.base_color_factor.unwrap_or([1.0; 4]).map(unit),
        alpha_cutoff: cutoff_of(material, at, warnings),
        see_through: material.alpha_mode.as_deref() == Some("BLEND"),
        double_sided: material.double_sided,
        emissive: material.emissive_factor.map(|factor| light(factor * strength)),
        metallic: unit(pbr.metallic_factor.unwrap_or(1.0)),
        roughness: unit(pbr.roughness_factor.unwrap_or(1.0)),
        transmission: unit(more.transmission.as_ref().map_or(0.0, |t| t.transmission_factor)),
        // Of a body of glass as well: how it bends light, its thickness alone does not say.
        thin: true,
        ior: more.ior.as_ref().and_then(|ior| ior.ior).filter(|ior| *ior >= 1.0).unwrap_or(1.5),
        specular: unit(specular.and_then(|specular| specular.specular_factor).unwrap_or(1.0)),
        specular_colour: specular.and_then(|specular| specular.specular_color_factor).unwrap_or([1.0; 3]).map(light),
        clearcoat: unit(clearcoat.map_or(0.0, |coat| coat.clearcoat_factor)),
        clearcoat_roughness: unit(clearcoat.map_or(0.0, |coat| coat.clearcoat_roughness_factor)),
        sheen: sheen.map_or([0.0; 3], |sheen| sheen.sheen_color_factor).map(unit),
        sheen_roughness: unit(sheen.map_or(0.0, |sheen| sheen.sheen_roughness_factor)),
        unlit: more.unlit.is_some(),
        ..Material::default()
    };
    match &more.specular_glossiness {
        Some(glossy) if glossy.specular_glossiness_texture.is_some() => {
            warnings.add(format!("{at}: drawn without its specular-glossiness texture"));
            from_glossy(glossy, numbers)
        }
        Some(glossy) => from_glossy(glossy, numbers),
        None => numbers,
    }
}

/// `KHR_materials_pbrSpecularGlossiness` says itself what is mirrored straight on: of no metal, whose index of refraction lets 4 % be mirrored.
fn from_glossy(glossy: &document::SpecularGlossiness, numbers: Material) -> Material {
    Material {
        base_colour: glossy.diffuse_factor.unwrap_or([1.0; 4]).map(unit),
        metallic: 0.0,
        roughness: 1.0 - unit(glossy.glossiness_factor.unwrap_or(1.0)),
        specular_colour: glossy.specular_factor.unwrap_or([1.0; 3]).map(|straight| unit(straight) / 0.04),
        ior: 1.5,
        ..numbers
    }
}

/// Finite, and not below 0.
fn light(x: f32) -> f32 {
    if x.is_finite() { x.max(0.0) } else { 0.0 }
}

/// Within 0 to 1.
fn unit(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) }
}

fn cutoff_of(material: &document::Material, at: &str, warnings: &mut Warnings) -> Option<f32> {
    match material.alpha_mode.as_deref() {
        None | Some("OPAQUE") => None,
        Some("MASK") => Some(material.alpha_cutoff.unwrap_or(DEFAULT_CUTOFF)),
        Some("BLEND") => Some(DEFAULT_CUTOFF),
        Some(mode) => {
            warnings.add(format!("{at}: unknown alphaMode {:?}, drawn opaque", shorten(mode)));
            None
        }
    }
}

struct Textures<'a> {
    document: &'a Document,
    images: Vec<Option<RgbaImage>>,
    textures: Vec<Texture>,
    /// By image and sampler, so that equal textures are stored once.
    known: HashMap<(usize, Option<usize>), u32>,
}

impl Textures<'_> {
    /// The scene's texture for what a material needs one for; `None` with a warning where there is no image.
    fn of(&mut self, info: &TextureInfo, what: &str, at: &str, warnings: &mut Warnings) -> Option<u32> {
        let image = image_of(self.document, Some(info));
        let found = image.filter(|&image| self.images[image].is_some());
        let Some(image) = found else {
            warnings.add(format!("{at}: drawn without its {what} texture, textures[{}] has no image", info.index));
            return None;
        };
        let sampler = self.document.textures[info.index].sampler;
        if let Some(&known) = self.known.get(&(image, sampler)) {
            return Some(known);
        }
        let pixels = self.images[image].as_ref()?;
        let default = Sampler::default();
        let settings = match sampler {
            Some(index) => self.document.samplers.get(index).unwrap_or_else(|| {
                warnings.add(format!("textures[{}].sampler: sampler {index} does not exist", info.index));
                &default
            }),
            None => &default,
        };
        let index = self.textures.len() as u32;
        self.textures.push(Texture {
            width_px: pixels.width(),
            height_px: pixels.height(),
            rgba: pixels.as_raw().clone(),
            wrap: [settings.wrap_s, settings.wrap_t].map(wrap_of),
            nearest: settings.mag_filter == Some(GL_NEAREST),
        });
        self.known.insert((image, sampler), index);
        Some(index)
    }
}

const GL_NEAREST: u32 = 9728;
const GL_CLAMP_TO_EDGE: u32 = 33_071;
const GL_MIRRORED_REPEAT: u32 = 33_648;

fn wrap_of(code: Option<u32>) -> Wrap {
    match code {
        Some(GL_CLAMP_TO_EDGE) => Wrap::Clamp,
        Some(GL_MIRRORED_REPEAT) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
