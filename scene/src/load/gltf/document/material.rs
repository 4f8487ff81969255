//! Materials, and the textures that they name.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::model::Quantity;

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::load::gltf) struct Material {
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
pub(in crate::load::gltf) struct MetallicRoughness {
    pub base_color_factor: Option<[f32; 4]>,
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Option<f32>,
    pub roughness_factor: Option<f32>,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(in crate::load::gltf) struct MaterialExtensions {
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
pub(in crate::load::gltf) struct Unlit {}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Transmission {
    #[serde(default)]
    pub transmission_factor: f32,
    pub transmission_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Specular {
    pub specular_factor: Option<f32>,
    pub specular_texture: Option<TextureInfo>,
    pub specular_color_factor: Option<[f32; 3]>,
    pub specular_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Clearcoat {
    #[serde(default)]
    pub clearcoat_factor: f32,
    pub clearcoat_texture: Option<TextureInfo>,
    #[serde(default)]
    pub clearcoat_roughness_factor: f32,
    pub clearcoat_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct Sheen {
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
pub(in crate::load::gltf) struct SpecularGlossiness {
    pub diffuse_factor: Option<[f32; 4]>,
    pub diffuse_texture: Option<TextureInfo>,
    pub specular_factor: Option<[f32; 3]>,
    pub glossiness_factor: Option<f32>,
    pub specular_glossiness_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Ior {
    pub ior: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct EmissiveStrength {
    pub emissive_strength: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct TextureInfo {
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
pub(in crate::load::gltf) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::load::gltf) struct TextureTransform {
    #[serde(default)]
    pub offset: [f32; 2],
    #[serde(default)]
    pub rotation: f32,
    pub scale: Option<[f32; 2]>,
    pub tex_coord: Option<u32>,
}

#[derive(Debug, Deserialize)]
pub(in crate::load::gltf) struct Texture {
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
pub(in crate::load::gltf) struct Image {
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
    pub mime_type: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(in crate::load::gltf) struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}
