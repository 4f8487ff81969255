//! Materials, and the textures that they are drawn with.
//!
//! Base colour and normal textures are kept. A metallic-roughness or emissive texture is replaced by its mean, which keeps the
//! amount of light right on the whole; occlusion textures are left out, and normal textures that lie otherwise than the base colour. Each of
//! these is a warning.

use std::collections::HashMap;

use super::document::{self, Document, Sampler, TextureInfo, TextureTransform};
use super::images::{Decoded, image_of};
use crate::load::Warnings;
use crate::load::source::shorten;
use crate::model::Bumps;
use crate::model::Wrap;
use crate::{Material, Texture};

/// A blended material is drawn as a cut-out at this opacity; it is also the default of masked ones (glTF 2.0, 5.19.9).
const DEFAULT_CUTOFF: f32 = 0.5;

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

    /// Applies `KHR_texture_transform`: scale, then rotation about the image's upper left, then offset.
    pub fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let Some(transform) = &self.transform else { return [u, v] };
        let [scale_u, scale_v] = transform.scale.unwrap_or([1.0; 2]);
        let (sin, cos) = transform.rotation.sin_cos();
        let (u, v) = (u * scale_u, v * scale_v);
        [cos * u + sin * v + transform.offset[0], cos * v - sin * u + transform.offset[1]]
    }
}

/// All materials of a document.
pub(super) struct Materials {
    /// The file's, then the default one, which primitives without a material have.
    pub materials: Vec<Material>,
    /// Of the scene.
    pub textures: Vec<Texture>,
    /// By material.
    pub uv_sources: Vec<Option<UvSource>>,
}

/// Makes the scene's materials from the document's and the images that they need.
pub(super) fn read(document: &Document, images: Vec<Option<Decoded>>, warnings: &mut Warnings) -> Materials {
    let mut textures = Textures { document, images, textures: Vec::new(), known: HashMap::new() };
    let mut all = Materials { materials: Vec::new(), textures: Vec::new(), uv_sources: Vec::new() };
    for (index, material) in document.materials.iter().enumerate() {
        let name = material.name.as_deref().map_or(String::new(), |name| format!(" {:?}", shorten(name)));
        let at = format!("materials[{index}]{name}");
        let info = material.pbr_metallic_roughness.base_color_texture.as_ref();
        let texture = info.and_then(|info| textures.of(info, "base colour", &at, warnings));
        let mut uv_source = texture.and(info).map(UvSource::of);
        let bumps = material.normal_texture.as_ref().and_then(|info| {
            let own = UvSource::of(info);
            if *uv_source.get_or_insert(own) != own {
                warnings
                    .add(format!("{at}: drawn without its normal texture, which lies otherwise than the base colour"));
                return None;
            }
            let texture = textures.of(info, "normal", &at, warnings)?;
            Some(Bumps { texture, scale: info.scale.filter(|scale| scale.is_finite()).unwrap_or(1.0) })
        });
        let material = material_of(material, texture, &textures, &at, warnings);
        all.materials.push(Material { bumps, ..material });
        all.uv_sources.push(uv_source);
    }
    all.materials.push(Material { metallic: 1.0, ..Material::default() });
    all.uv_sources.push(None);
    all.textures = textures.textures;
    all
}

fn material_of(
    material: &document::Material,
    texture: Option<u32>,
    textures: &Textures<'_>,
    at: &str,
    warnings: &mut Warnings,
) -> Material {
    let pbr = &material.pbr_metallic_roughness;
    let extensions = &material.extensions;
    let (mut metallic, mut roughness) = (pbr.metallic_factor.unwrap_or(1.0), pbr.roughness_factor.unwrap_or(1.0));
    if let Some(info) = &pbr.metallic_roughness_texture {
        if let Some(mean) = textures.mean(info) {
            roughness *= mean.raw[1];
            metallic *= mean.raw[2];
        }
        warnings.add(format!("{at}: the metallic-roughness texture is replaced by its mean"));
    }
    let strength = extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength).unwrap_or(1.0);
    let mut emissive = material.emissive_factor.map(|factor| factor * strength);
    if let Some(info) = &material.emissive_texture {
        let mean = textures.mean(info).map_or([1.0; 3], |mean| mean.linear);
        emissive = std::array::from_fn(|channel| emissive[channel] * mean[channel]);
        warnings.add(format!("{at}: the emissive texture is replaced by its mean"));
    }
    Material {
        name: material.name.clone().unwrap_or_default(),
        base_colour: pbr.base_color_factor.unwrap_or([1.0; 4]).map(unit),
        texture,
        bumps: None,
        alpha_cutoff: cutoff_of(material, at, warnings),
        double_sided: material.double_sided,
        emissive: emissive.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 }),
        metallic: unit(metallic),
        roughness: unit(roughness),
        transmission: unit(extensions.transmission.as_ref().map_or(0.0, |t| t.transmission_factor)),
        ior: extensions.ior.as_ref().and_then(|ior| ior.ior).filter(|ior| *ior >= 1.0).unwrap_or(1.5),
        unlit: extensions.unlit.is_some(),
    }
}

/// Within 0 to 1.
fn unit(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) }
}

fn cutoff_of(material: &document::Material, at: &str, warnings: &mut Warnings) -> Option<f32> {
    match material.alpha_mode.as_deref() {
        None | Some("OPAQUE") => None,
        Some("MASK") => Some(material.alpha_cutoff.unwrap_or(DEFAULT_CUTOFF)),
        Some("BLEND") => {
            warnings.add(format!("{at}: alpha blending is drawn as a cut-out at {DEFAULT_CUTOFF}"));
            Some(DEFAULT_CUTOFF)
        }
        Some(mode) => {
            warnings.add(format!("{at}: unknown alphaMode {:?}, drawn opaque", shorten(mode)));
            None
        }
    }
}

struct Textures<'a> {
    document: &'a Document,
    images: Vec<Option<Decoded>>,
    textures: Vec<Texture>,
    /// By image and sampler, so that equal textures are stored once.
    known: HashMap<(usize, Option<usize>), u32>,
}

impl Textures<'_> {
    /// The scene's texture for what a material needs one for; `None` with a warning where there is no image.
    fn of(&mut self, info: &TextureInfo, what: &str, at: &str, warnings: &mut Warnings) -> Option<u32> {
        let image = image_of(self.document, Some(info));
        let found = image.filter(|&image| self.images[image].as_ref().is_some_and(|decoded| decoded.pixels.is_some()));
        let Some(image) = found else {
            warnings.add(format!("{at}: drawn without its {what} texture, textures[{}] has no image", info.index));
            return None;
        };
        let sampler = self.document.textures[info.index].sampler;
        if let Some(&known) = self.known.get(&(image, sampler)) {
            return Some(known);
        }
        let pixels = self.images[image].as_ref().and_then(|decoded| decoded.pixels.as_ref())?;
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

    fn mean(&self, info: &TextureInfo) -> Option<super::images::Mean> {
        self.images[image_of(self.document, Some(info))?].as_ref()?.mean
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
