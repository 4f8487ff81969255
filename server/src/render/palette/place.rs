//! A material with what its textures say somewhere, as a point among others, and what several are in the mean.

use protocol::Material;
use scene::model::{Map, Quantity, Texture};

/// A material as a point: what differs much is far away. 0 to 1 each.
pub(super) type Place = [f32; 17];

/// The place of a material.
pub(super) fn place(material: &Material) -> Place {
    // As far as light is told from light: bright ones by ratio.
    let seen = |light: f32| (light / (1.0 + light)).sqrt();
    let [er, eg, eb] = material.emissive.map(seen);
    let [sr, sg, sb] = material.straight.map(f32::sqrt);
    let [hr, hg, hb] = material.sheen.map(f32::sqrt);
    [
        er,
        eg,
        eb,
        material.metallic,
        material.roughness,
        material.transmission,
        // What else differs is seen only where there is some of it.
        material.occlusion.sqrt(),
        material.clearcoat,
        material.clearcoat * material.clearcoat_roughness,
        sr,
        sg,
        sb,
        material.grazing,
        hr,
        hg,
        hb,
        hr.max(hg).max(hb) * material.sheen_roughness,
    ]
}

pub(super) fn distance_squared(a: &Place, b: &Place) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// A material with the numbers that its maps say somewhere; `texel` is of each of them, 0 to 1 a channel, colours in linear light.
pub(super) fn with_texels(material: &scene::Material, texel: impl Fn(usize) -> [f32; 4]) -> Material {
    let mut shown = Material {
        emissive: material.emissive,
        metallic: material.metallic,
        roughness: material.roughness,
        transmission: material.transmission,
        thin: material.thin && material.transmission > 0.0,
        ior: material.ior,
        straight: [0.0; 3],
        grazing: material.specular,
        occlusion: 1.0,
        clearcoat: material.clearcoat,
        clearcoat_roughness: material.clearcoat_roughness,
        sheen: material.sheen,
        sheen_roughness: material.sheen_roughness,
        unlit: material.unlit,
        double_sided: material.double_sided,
    };
    let mut specular_colour = material.specular_colour;
    let by = |[r, g, b]: [f32; 3], texel: [f32; 4]| [r * texel[0], g * texel[1], b * texel[2]];
    for (index, &Map { quantity, strength, .. }) in material.maps.iter().enumerate() {
        let texel = texel(index);
        match quantity {
            Quantity::MetallicRoughness => {
                shown.roughness *= texel[1];
                shown.metallic *= texel[2];
            }
            Quantity::Occlusion => shown.occlusion = 1.0 + strength * (texel[0] - 1.0),
            Quantity::Emissive => shown.emissive = by(shown.emissive, texel),
            Quantity::Transmission => shown.transmission *= texel[0],
            Quantity::Specular => shown.grazing *= texel[3],
            Quantity::SpecularColour => specular_colour = by(specular_colour, texel),
            Quantity::Clearcoat => shown.clearcoat *= texel[0],
            Quantity::ClearcoatRoughness => shown.clearcoat_roughness *= texel[1],
            Quantity::Sheen => shown.sheen = by(shown.sheen, texel),
            Quantity::SheenRoughness => shown.sheen_roughness *= texel[3],
        }
    }
    let ratio = (material.ior - 1.0) / (material.ior + 1.0);
    shown.straight = specular_colour.map(|colour| (ratio * ratio * colour).min(1.0) * shown.grazing);
    shown
}

/// A material whose textures are everywhere their mean.
pub(crate) fn on_the_whole(material: &scene::Material, textures: &[Texture]) -> Material {
    let mean = |map: &Map| textures[map.texture as usize].mean(map.quantity.is_colour());
    let means: Vec<[f32; 4]> = material.maps.iter().map(mean).collect();
    with_texels(material, |index| means[index])
}

/// The mean of materials of one kind.
pub(super) fn mean<'a>(members: impl Iterator<Item = &'a Material> + Clone) -> Material {
    let count = members.clone().count().max(1) as f32;
    let of = |number: fn(&Material) -> f32| members.clone().map(number).sum::<f32>() / count;
    let first = members.clone().next().copied().unwrap_or_default();
    let rgb = |number: fn(&Material) -> [f32; 3]| {
        [0, 1, 2].map(|channel| members.clone().map(|material| number(material)[channel]).sum::<f32>() / count)
    };
    let mut mean = Material {
        emissive: rgb(|material| material.emissive),
        metallic: of(|material| material.metallic),
        roughness: of(|material| material.roughness),
        transmission: of(|material| material.transmission),
        straight: rgb(|material| material.straight),
        grazing: of(|material| material.grazing),
        occlusion: of(|material| material.occlusion),
        clearcoat: of(|material| material.clearcoat),
        clearcoat_roughness: of(|material| material.clearcoat_roughness),
        sheen: rgb(|material| material.sheen),
        sheen_roughness: of(|material| material.sheen_roughness),
        ..first
    };
    // Impostors are made for materials that are mirrors on the whole: a smooth spot shows what is far around. What has the limit itself is a mirror: a hundredth
    // more is far above what an f32 rounds, and a quarter of a step of roughness in 8 bits.
    if mean.metallic >= Material::MIRROR_METALLIC {
        mean.roughness = mean.roughness.max(Material::MIRROR_ROUGHNESS * 1.01);
    }
    mean
}

/// Sets what a quantity says of a material to what it is of another.
pub(super) fn take(shown: &mut Material, from: &Material, quantity: Quantity) {
    match quantity {
        Quantity::MetallicRoughness => (shown.metallic, shown.roughness) = (from.metallic, from.roughness),
        Quantity::Occlusion => shown.occlusion = from.occlusion,
        Quantity::Emissive => shown.emissive = from.emissive,
        Quantity::Transmission => shown.transmission = from.transmission,
        Quantity::Specular => (shown.grazing, shown.straight) = (from.grazing, from.straight),
        Quantity::SpecularColour => shown.straight = from.straight,
        Quantity::Clearcoat => shown.clearcoat = from.clearcoat,
        Quantity::ClearcoatRoughness => shown.clearcoat_roughness = from.clearcoat_roughness,
        Quantity::Sheen => shown.sheen = from.sheen,
        Quantity::SheenRoughness => shown.sheen_roughness = from.sheen_roughness,
    }
}
