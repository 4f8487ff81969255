//! The material table of the samples, and the materials of the surfaces that are drawn.

use bytemuck::{Pod, Zeroable};
use gpu::MaterialUniform;
use protocol::Material;
use scene::Scene;
use scene::model::{SAME_UV, UvMap, UvSet, Wrap};

use super::palette::{self, CodeMap, CodeSet, Kinds, Palette};

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
    /// Whether its code is told place by place, and how what tells it is wrapped.
    pub varies: u32,
    /// The same by the second set of texture coordinates; what both tell is added.
    pub varies_by_second: u32,
    /// Whether, where it is seen through, not its alpha but its material says how much.
    pub is_pane: u32,
    /// Whether its normal map goes by the second set of texture coordinates.
    pub bumps_by_second: u32,
    pub padding: [u32; 3],
    pub bumps_from_u: [f32; 4],
    pub bumps_from_v: [f32; 4],
    pub codes_from_u: [f32; 4],
    pub codes_from_v: [f32; 4],
    pub second_codes_from_u: [f32; 4],
    pub second_codes_from_v: [f32; 4],
}

impl SurfaceMaterial {
    /// Whether it has a normal map or varies from place to place.
    pub fn is_detailed(&self) -> bool {
        self.bump_scale != 0.0 || self.varies != 0 || self.varies_by_second != 0
    }

    /// The same without these.
    pub fn without_detail(&self) -> SurfaceMaterial {
        SurfaceMaterial { bump_scale: 0.0, varies: 0, varies_by_second: 0, ..*self }
    }
}

/// The scene's materials as the shader has them, and what their samples refer to.
pub(crate) struct Tables {
    pub surfaces: Vec<SurfaceMaterial>,
    /// By code.
    pub table: Vec<Material>,
    /// By material of the scene: where its codes lie, of one that varies.
    pub code_maps: Vec<Option<CodeMap>>,
    /// By code.
    pub kinds: Kinds,
}

/// The table of the materials that are shown and differ in what samples need; all others have its first code. A scene with more than 256 such keeps the first and maps the others to the
/// nearest, which is logged. What is left of the table goes to those that vary from place to place, see [`super::palette`], if they are
/// asked for; else each is everywhere what it is on the whole.
pub(crate) fn tables(scene: &Scene, varied: bool) -> Tables {
    let mut table: Vec<Material> = Vec::new();
    let mut dropped = 0;
    let shown = scene.shown_materials();
    let is_shown = |index: usize| shown.contains(&(index as u32));
    let is_varied = |index: usize| varied && is_shown(index) && !scene.materials[index].maps.is_empty();
    let mut wanted: Vec<usize> = (0..scene.materials.len()).filter(|&index| is_varied(index)).collect();
    let varying = wanted.len();
    // Each that varies gets one code at least.
    let most = MaterialUniform::TABLE_LEN.saturating_sub(varying).max(MaterialUniform::TABLE_LEN / 2);
    let codes: Vec<usize> = scene
        .materials
        .iter()
        .enumerate()
        .map(|(index, material)| {
            if !is_shown(index) {
                return 0;
            }
            let wanted = palette::on_the_whole(material, &scene.textures);
            table.iter().position(|known| *known == wanted).unwrap_or_else(|| {
                if table.len() < most {
                    table.push(wanted);
                    table.len() - 1
                } else {
                    dropped += 1;
                    nearest(&table, &wanted)
                }
            })
        })
        .collect();
    if dropped > 0 {
        tracing::warn!("{dropped} materials past the first {most} are shown as the nearest");
    }
    if table.is_empty() {
        table.push(Material::default());
    }
    let room = MaterialUniform::TABLE_LEN - table.len();
    if wanted.len() > room {
        tracing::warn!("{} materials past the first {room} that vary are shown as on the whole", wanted.len() - room);
        wanted.truncate(room);
    }
    let Palette { entries, code_maps, kinds } = Palette::new(scene, &wanted, table.len());
    table.extend(entries);
    let surface = |(index, material): (usize, &scene::Material)| {
        let (code, map) = (codes[index], code_maps[index].as_ref());
        let own = map.map_or(code..code + 1, |map| map.codes.clone());
        let reflects = table[own].iter().any(|material| material.effect().is_some());
        let rows = |map: UvMap| map.map(|[x, y, offset]| [x, y, offset, 0.0]);
        let [bumps_from_u, bumps_from_v] = rows(material.bumps.map_or(SAME_UV, |bumps| bumps.from_uv));
        let [first, second] = map.map_or([None, None], |map| map.sets.each_ref().map(Option::as_ref));
        let from_uv = |set: Option<&CodeSet>| rows(set.map_or(SAME_UV, |set| set.from_uv));
        let ([codes_from_u, codes_from_v], [second_codes_from_u, second_codes_from_v]) =
            (from_uv(first), from_uv(second));
        let varies =
            |set: Option<&CodeSet>| set.map_or(0, |set| 1 + wrap_code(set.wrap[0]) + 3 * wrap_code(set.wrap[1]));
        let bumps_by_second = material.bumps.is_some_and(|bumps| bumps.uv_set == UvSet::Second);
        SurfaceMaterial {
            base_colour: material.base_colour,
            alpha_cutoff: material.alpha_cutoff.unwrap_or(0.0),
            code: code as u32,
            double_sided: u32::from(material.double_sided),
            fine: if reflects || material.is_pane() { FINE_NORMAL } else { 0 },
            bump_scale: material.bumps.map_or(0.0, |bumps| bumps.scale),
            varies: varies(first),
            varies_by_second: varies(second),
            is_pane: u32::from(material.is_pane()),
            bumps_by_second: u32::from(bumps_by_second),
            padding: [0; 3],
            bumps_from_u,
            bumps_from_v,
            codes_from_u,
            codes_from_v,
            second_codes_from_u,
            second_codes_from_v,
        }
    };
    let surfaces = scene.materials.iter().enumerate().map(surface).collect();
    Tables { surfaces, table, code_maps, kinds }
}

/// As `server/scene.wgsl` tells them.
fn wrap_code(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
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
            bump_scale,
            varies,
            varies_by_second,
            is_pane,
            bumps_by_second,
            bumps_from_u,
            bumps_from_v,
            codes_from_u,
            codes_from_v,
            second_codes_from_u,
            second_codes_from_v
        );
    }

    #[test]
    fn materials_past_the_table_take_the_nearest() {
        let with_roughness = |roughness: f32| Material { roughness, ..Material::default() };
        let table: Vec<Material> = (0..10).map(|step| with_roughness(step as f32 / 10.0)).collect();
        assert_eq!(nearest(&table, &with_roughness(0.33)), 3);
    }
}
