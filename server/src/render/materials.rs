//! The material table of the samples, and the materials of the surfaces that are drawn.

use bytemuck::{Pod, Zeroable};
use gpu::MaterialUniform;
use protocol::Material;
use scene::Scene;

/// Normals: of a mirror or glass, and of everything in a view at rest.
pub(super) const FINE_NORMAL: u32 = 1;
/// Colours: of everything in a view at rest.
pub(super) const FINE_COLOUR: u32 = 2;

/// `SurfaceMaterial` of `server/scene.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct SurfaceMaterial {
    pub base_colour: [f32; 4],
    pub alpha_cutoff: f32,
    pub code: u32,
    pub double_sided: u32,
    /// What is kept finely: [`FINE_NORMAL`], [`FINE_COLOUR`].
    pub fine: u32,
    /// Of its normal map; 0 without one.
    pub bump_scale: f32,
    pub padding: [u32; 3],
}

/// The scene's materials as the shader has them, and the table of those that differ in what samples need. A scene with more
/// than 256 such keeps the first and maps the others to the nearest, which is logged.
pub(crate) fn tables(scene: &Scene) -> (Vec<SurfaceMaterial>, Vec<Material>) {
    let mut table: Vec<Material> = Vec::new();
    let mut dropped = 0;
    let surfaces = scene
        .materials
        .iter()
        .map(|material| {
            let wanted = shown(material);
            let code = table.iter().position(|known| *known == wanted).unwrap_or_else(|| {
                if table.len() < MaterialUniform::TABLE_LEN {
                    table.push(wanted);
                    table.len() - 1
                } else {
                    dropped += 1;
                    nearest(&table, &wanted)
                }
            });
            SurfaceMaterial {
                base_colour: material.base_colour,
                alpha_cutoff: material.alpha_cutoff.unwrap_or(0.0),
                code: code as u32,
                double_sided: u32::from(material.double_sided),
                fine: if table[code].effect().is_some() { FINE_NORMAL } else { 0 },
                bump_scale: material.bumps.map_or(0.0, |bumps| bumps.scale),
                padding: [0; 3],
            }
        })
        .collect();
    if dropped > 0 {
        tracing::warn!("{dropped} materials past the first {} are shown as the nearest", MaterialUniform::TABLE_LEN);
    }
    (surfaces, table)
}

fn shown(material: &scene::Material) -> Material {
    Material {
        emissive: material.emissive,
        metallic: material.metallic,
        roughness: material.roughness,
        transmission: material.transmission,
        ior: material.ior,
        unlit: material.unlit,
        double_sided: material.double_sided,
    }
}

fn nearest(table: &[Material], wanted: &Material) -> usize {
    let distance = |other: &Material| -> f32 {
        let emissive: f32 = other.emissive.iter().zip(wanted.emissive).map(|(a, b)| (a - b).abs()).sum();
        let unlit = if other.unlit == wanted.unlit { 0.0 } else { 100.0 };
        emissive
            + (other.metallic - wanted.metallic).abs()
            + (other.roughness - wanted.roughness).abs()
            + (other.transmission - wanted.transmission).abs()
            + (other.ior - wanted.ior).abs()
            + unlit
    };
    let by_distance = |a: &(usize, f32), b: &(usize, f32)| a.1.total_cmp(&b.1);
    table.iter().map(distance).enumerate().min_by(by_distance).map_or(0, |(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surface_materials_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(
            SurfaceMaterial,
            "server/scene.wgsl",
            "SurfaceMaterial",
            base_colour,
            alpha_cutoff,
            code,
            double_sided,
            fine,
            bump_scale
        );
    }

    #[test]
    fn materials_past_the_table_take_the_nearest() {
        let with_roughness = |roughness: f32| Material { roughness, ..Material::default() };
        let table: Vec<Material> = (0..10).map(|step| with_roughness(step as f32 / 10.0)).collect();
        assert_eq!(nearest(&table, &with_roughness(0.33)), 3);
    }
}
