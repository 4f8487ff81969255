//! What the textures of a material say together by one set of texture coordinates, and where its codes lie.

use glam::{Affine2, Mat2, Vec2};
use protocol::Material;
use rayon::prelude::*;
use scene::model::{Map, Texture, UvMap, UvSet, Wrap};

use super::cuts::Cuts;
use super::place::{place, with_texels};
use crate::render::texture::{self, CodeLevel, Content, Level};

/// Texels that entries are made of at most, strewn over the finest level; those of coarse levels, which hold means, come on top.
const MAX_MEMBERS: usize = 1 << 14;

/// Codes by one set of texture coordinates; those of both are added.
#[derive(Debug, Clone)]
pub(crate) struct CodeSet {
    pub levels: Vec<CodeLevel>,
    /// From the set's coordinates.
    pub from_uv: UvMap,
    pub wrap: [Wrap; 2],
}

/// A material that varies by a set of texture coordinates, and the levels of its textures.
pub(super) struct Source<'a> {
    material: &'a scene::Material,
    /// Of all maps of the material, those of the set.
    maps: Vec<Option<SourceMap>>,
    from_uv: UvMap,
    wrap: [Wrap; 2],
    size_px: [u32; 2],
}

struct SourceMap {
    levels: Vec<Level>,
    /// From the coordinates of the first map.
    from_first: Affine2,
    wrap: [Wrap; 2],
    is_colour: bool,
}

fn affine(map: UvMap) -> Affine2 {
    let [[a, b, x], [c, d, y]] = map;
    Affine2 { matrix2: Mat2::from_cols(Vec2::new(a, c), Vec2::new(b, d)), translation: Vec2::new(x, y) }
}

impl<'a> Source<'a> {
    /// `None` where it has no map by that set.
    pub(super) fn new(
        material: &'a scene::Material,
        textures: &[Texture],
        set: UvSet,
        max_side_px: u32,
    ) -> Option<Source<'a>> {
        let is_own = |map: &&Map| map.uv_set == set;
        let leading = material.maps.iter().find(is_own)?;
        let first = affine(leading.from_uv);
        let map = |map: &Map| {
            let texture = &textures[map.texture as usize];
            let is_colour = map.quantity.is_colour();
            let content = if is_colour { Content::Colours(None) } else { Content::Numbers };
            // A first map that is drawn out into a line says nothing of the others: as they lie.
            let from_first = Some(affine(map.from_uv) * first.inverse()).filter(|map| map.is_finite());
            let from_first = from_first.unwrap_or(Affine2::IDENTITY);
            SourceMap { levels: texture::levels(texture, content), from_first, wrap: texture.wrap, is_colour }
        };
        let maps: Vec<_> = material.maps.iter().map(|own| Some(own).filter(is_own).map(map)).collect();
        let side = |of: fn(&Level) -> u32| {
            maps.iter().flatten().map(|map| of(&map.levels[0])).max().map_or(1, |side| side.clamp(1, max_side_px))
        };
        let size_px = [side(|level| level.width_px), side(|level| level.height_px)];
        let wrap = textures[leading.texture as usize].wrap;
        Some(Source { material, maps, from_uv: leading.from_uv, wrap, size_px })
    }

    fn level_size(&self, level: u32) -> [u32; 2] {
        self.size_px.map(|side| (side >> level).max(1))
    }

    fn level_count(&self) -> u32 {
        self.size_px[0].max(self.size_px[1]).ilog2() + 1
    }

    /// The levels of the maps whose texels are about as large as those of a level of codes.
    fn alike(&self, level: u32) -> Vec<Option<(&SourceMap, &Level)>> {
        let [width_px, _] = self.level_size(level);
        let of = |map: &SourceMap| {
            let texels = map.levels[0].width_px as f32 * map.from_first.matrix2.x_axis.length() / width_px as f32;
            (texels.max(1.0).log2().round() as usize).min(map.levels.len() - 1)
        };
        self.maps.iter().map(|map| map.as_ref().map(|map| (map, &map.levels[of(map)]))).collect()
    }

    /// What the material is at a texel of a level, as far as this set tells.
    fn at(
        &self,
        alike: &[Option<(&SourceMap, &Level)>],
        [width_px, height_px]: [u32; 2],
        (x, y): (u32, u32),
    ) -> Material {
        let uv = Vec2::new((x as f32 + 0.5) / width_px as f32, (y as f32 + 0.5) / height_px as f32);
        with_texels(self.material, |index| alike[index].map_or([1.0; 4], |(map, level)| map.texel(level, uv)))
    }

    pub(super) fn cuts(&self) -> Cuts {
        let mut members = Vec::new();
        // From 64 texels along a side on: there it is means that are seen.
        let coarse = self.level_count().saturating_sub(7).max(1)..self.level_count();
        for level in std::iter::once(0).chain(coarse) {
            let ([width_px, height_px], alike) = (self.level_size(level), self.alike(level));
            let texels = width_px as usize * height_px as usize;
            // An odd step: widths are even, so that all columns are seen.
            let step = (texels / MAX_MEMBERS).max(1) | 1;
            let texel = |index: usize| {
                let place = ((index % width_px as usize) as u32, (index / width_px as usize) as u32);
                self.at(&alike, [width_px, height_px], place)
            };
            members.extend((0..texels).step_by(step).map(texel));
        }
        Cuts::new(members)
    }

    pub(super) fn code_set(&self, cuts: &Cuts) -> CodeSet {
        let level = |level: u32| {
            let (size_px, alike) = (self.level_size(level), self.alike(level));
            let row = |y: u32| {
                let alike = &alike;
                // Texels next to each other are often the same.
                let mut last: Option<(Material, u8)> = None;
                let code = move |x: u32| {
                    let material = self.at(alike, size_px, (x, y));
                    let code = match last {
                        Some((known, code)) if known == material => code,
                        _ => cuts.code(&place(&material)),
                    };
                    last = Some((material, code));
                    code
                };
                (0..size_px[0]).map(code).collect::<Vec<u8>>()
            };
            let codes = (0..size_px[1]).into_par_iter().flat_map_iter(row).collect();
            CodeLevel { width_px: size_px[0], height_px: size_px[1], codes }
        };
        CodeSet { levels: (0..self.level_count()).map(level).collect(), from_uv: self.from_uv, wrap: self.wrap }
    }
}

impl SourceMap {
    fn texel(&self, level: &Level, uv: Vec2) -> [f32; 4] {
        let uv = self.from_first.transform_point2(uv).to_array();
        let side = [level.width_px, level.height_px];
        let [x, y] = [0, 1].map(|axis| {
            let share = match self.wrap[axis] {
                Wrap::Repeat => uv[axis].rem_euclid(1.0),
                Wrap::Mirror => 1.0 - (1.0 - uv[axis].rem_euclid(2.0)).abs(),
                Wrap::Clamp => uv[axis],
            };
            // Not a number counts as 0.
            ((share * side[axis] as f32).max(0.0) as u32).min(side[axis] - 1) as usize
        });
        let at = 4 * (y * level.width_px as usize + x);
        std::array::from_fn(|channel| texture::decoded(level.rgba[at + channel], self.is_colour && channel < 3))
    }
}
