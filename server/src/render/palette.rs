//! Materials that vary from place to place, in the table of materials.
//!
//! A sample refers to a material by one byte. Where textures say how rough, metallic or bright a surface is, place by place, that byte tells it
//! too: what the textures of a material say together is cut into as many parts as the table has room for, and each part is an entry, the mean of its
//! members. Parts are cut in two where they are widest, along one of their numbers, the part with the most error first (Heckbert, *Color image
//! quantization for frame buffer display*, 1982; by variance as Wan, Wong, Prusinkiewicz, 1988), until entries are as near to their members as
//! [`FINE_ENOUGH`]. So a sample costs no plane more, all that lights samples works as it is, and a scene of materials that do not vary has one
//! byte that is the same everywhere, which is no byte. Entries are numbered along the cuts: codes that are near stand for what is alike.
//!
//! Which entry lies where is looked up on the GPU in a texture of codes, whose every level is made of the same level of the textures: codes
//! themselves have no mean.
//!
//! Textures by the second set of coordinates of a mesh meet those of the first anywhere. Each set's are cut into parts of their own, and every pair of
//! parts is an entry; there are two textures of codes then, and a surface has the sum of both.

use std::ops::Range;

use glam::{Affine2, Mat2, Vec2};
use gpu::MaterialUniform;
use protocol::Material;
use rayon::prelude::*;
use scene::Scene;
use scene::model::{Map, Quantity, Texture, UvMap, UvSet, Wrap};

use super::texture::{self, CodeLevel, Content, Level};

/// Parts whose members are, in the mean of squares, this near to their entry are not cut, in numbers of which 1 is all that there is. Chosen, not
/// derived: a part is a sixtieth wide then, about four steps of the picture's 8 bits. Six materials of a helmet fill the
/// table before they come so near, and those of a test of clear coats take 133 entries.
const FINE_ENOUGH: f32 = 0.005;
/// Texels that entries are made of at most, strewn over the finest level; those of coarse levels, which hold means, come on top.
const MAX_MEMBERS: usize = 1 << 14;
/// Sides of textures of codes at most, and texels of all of them together.
const MAX_SIDE_PX: u32 = 2048;
/// See [`MAX_SIDE_PX`].
const MAX_TEXELS: usize = 1 << 28;

/// A material as a point: what differs much is far away. 0 to 1 each.
pub(crate) type Place = [f32; 17];

/// The place of a material.
pub(crate) fn place(material: &Material) -> Place {
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

fn distance_squared(a: &Place, b: &Place) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// A material with the numbers that its maps say somewhere; `texel` is of each of them, 0 to 1 a channel, colours in linear light.
fn with_texels(material: &scene::Material, texel: impl Fn(usize) -> [f32; 4]) -> Material {
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
fn mean<'a>(members: impl Iterator<Item = &'a Material> + Clone) -> Material {
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
    // Impostors are made for materials that are mirrors on the whole: a smooth spot shows what is far around.
    if mean.metallic >= Material::MIRROR_METALLIC {
        mean.roughness = mean.roughness.max(Material::MIRROR_ROUGHNESS * 1.01);
    }
    mean
}

/// Sets what a quantity says of a material to what it is of another.
fn take(shown: &mut Material, from: &Material, quantity: Quantity) {
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

/// Which codes belong together: those of one material that varies.
#[derive(Debug, Clone, Default)]
pub struct Kinds {
    /// Of each material that varies, ascending.
    ranges: Vec<Range<usize>>,
    /// By code, of all before the end of the last range.
    places: Vec<Place>,
    /// By code, the same.
    range_of: Vec<Option<u8>>,
}

impl Kinds {
    fn new(ranges: Vec<Range<usize>>, first: usize, entries: &[Material]) -> Kinds {
        let nowhere = [0.0; size_of::<Place>() / 4];
        let places = std::iter::repeat_n(nowhere, first).chain(entries.iter().map(place)).collect();
        let mut range_of = vec![None; first + entries.len()];
        for (number, range) in ranges.iter().enumerate() {
            range_of[range.clone()].fill(Some(number as u8));
        }
        Kinds { ranges, places, range_of }
    }

    fn range(&self, code: u8) -> Option<u8> {
        self.range_of.get(usize::from(code)).copied().flatten()
    }

    /// Whether two codes are of one material, at two places of it or at one.
    pub(crate) fn are_one(&self, a: u8, b: u8) -> bool {
        a == b || self.range(a).is_some_and(|range| self.range(b) == Some(range))
    }

    /// The code that is nearest to the mean of some, all of one material.
    pub(crate) fn mean(&self, codes: &[u8]) -> u8 {
        let Some(&first) = codes.first() else { return 0 };
        let Some(range) = self.range(first).filter(|_| codes.iter().any(|code| *code != first)) else { return first };
        let mut mean = [0.0; size_of::<Place>() / 4];
        for place in codes.iter().map(|&code| &self.places[usize::from(code)]) {
            mean.iter_mut().zip(place).for_each(|(sum, number)| *sum += number / codes.len() as f32);
        }
        let distance = |code: &usize| distance_squared(&self.places[*code], &mean);
        let range = self.ranges[usize::from(range)].clone();
        range.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(first, |code| code as u8)
    }
}

/// Where the codes of a material lie.
#[derive(Debug, Clone)]
pub(crate) struct CodeMap {
    /// By set of texture coordinates; one of them at least.
    pub sets: [Option<CodeSet>; 2],
    /// Which there are.
    pub codes: Range<usize>,
}

/// Codes by one set of texture coordinates; those of both are added.
#[derive(Debug, Clone)]
pub(crate) struct CodeSet {
    pub levels: Vec<CodeLevel>,
    /// From the set's coordinates.
    pub from_uv: UvMap,
    pub wrap: [Wrap; 2],
}

/// See the module.
pub(crate) struct Palette {
    /// In the order of their codes.
    pub entries: Vec<Material>,
    /// By material of the scene.
    pub code_maps: Vec<Option<CodeMap>>,
    pub kinds: Kinds,
}

/// Sets of texture coordinates in the order of [`CodeMap::sets`].
const SETS: [UvSet; 2] = [UvSet::First, UvSet::Second];

impl Palette {
    /// Of the materials of a scene whose numbers are `varying`, at most as many as there are codes from `first` on, the first one.
    pub fn new(scene: &Scene, varying: &[usize], first: usize) -> Palette {
        let room = MaterialUniform::TABLE_LEN - first;
        assert!(varying.len() <= room, "a code each");
        let share = MAX_TEXELS / varying.len().max(1);
        let max_side_px = MAX_SIDE_PX.min(1 << (share.ilog2() / 2));
        // Levels of textures are large: no more of them are there than threads.
        let source = |index: usize, set: UvSet| Source::new(&scene.materials[index], &scene.textures, set, max_side_px);
        let divided = |&index: &usize| Divided(SETS.map(|set| Some(source(index, set)?.cuts())));
        let mut all: Vec<Divided> = varying.par_iter().map(divided).collect();
        let mut left = room - varying.len();
        while let Some(worst) =
            all.iter_mut().flat_map(|divided| divided.cuttable(left)).max_by(|a, b| a.error.total_cmp(&b.error))
        {
            left -= worst.codes;
            worst.cuts.cut();
        }
        let (mut entries, mut ranges) = (Vec::new(), Vec::new());
        for (divided, &index) in all.iter_mut().zip(varying) {
            let next = first + entries.len();
            entries.extend(divided.number(&scene.materials[index], next));
            ranges.push(next..first + entries.len());
        }
        let mut code_maps = vec![None; scene.materials.len()];
        let maps: Vec<CodeMap> = (varying.par_iter().zip(&all).zip(&ranges))
            .map(|((&index, Divided(cuts)), codes)| {
                let of = |set: usize| Some(source(index, SETS[set])?.code_set(cuts[set].as_ref()?));
                CodeMap { sets: [of(0), of(1)], codes: codes.clone() }
            })
            .collect();
        varying.iter().zip(maps).for_each(|(&index, map)| code_maps[index] = Some(map));
        Palette { kinds: Kinds::new(ranges, first, &entries), entries, code_maps }
    }
}

/// What a material is in its places, cut into parts, by set of texture coordinates.
struct Divided([Option<Cuts>; 2]);

/// A cut that can be made.
struct Cuttable<'a> {
    cuts: &'a mut Cuts,
    /// What it mends.
    error: f32,
    /// That it takes.
    codes: usize,
}

impl Divided {
    /// Those for which as many codes are left: a cut of one set is one of each part of the other.
    fn cuttable(&mut self, left: usize) -> impl Iterator<Item = Cuttable<'_>> {
        let counts = [0, 1].map(|set| self.0[set].as_ref().map_or(1, Cuts::count));
        self.0.iter_mut().zip(counts.into_iter().rev()).filter_map(move |(cuts, codes)| {
            let cuts = cuts.as_mut()?;
            let error = cuts.worst();
            (error > 0.0 && codes <= left).then_some(Cuttable { cuts, error, codes })
        })
    }

    /// Numbers all pairs of parts from `first` on; what each is on the whole.
    fn number(&mut self, material: &scene::Material, first: usize) -> Vec<Material> {
        let [first_set, second_set] = &mut self.0;
        let entries = first_set.as_mut().map(|cuts| cuts.number(first, 1));
        let Some(second_set) = second_set else { return entries.unwrap_or_default() };
        let Some(entries) = entries else { return second_set.number(first, 1) };
        let of_second = || material.maps.iter().filter(|map| map.uv_set == UvSet::Second);
        let both = |entry: &Material, second: &Material| {
            let mut both = *entry;
            of_second().for_each(|map| take(&mut both, second, map.quantity));
            both
        };
        let seconds = second_set.number(0, entries.len());
        seconds.iter().flat_map(|second| entries.iter().map(|entry| both(entry, second))).collect()
    }
}

/// A material that varies by a set of texture coordinates, and the levels of its textures.
struct Source<'a> {
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
    fn new(material: &'a scene::Material, textures: &[Texture], set: UvSet, max_side_px: u32) -> Option<Source<'a>> {
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

    fn cuts(&self) -> Cuts {
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

    fn code_set(&self, cuts: &Cuts) -> CodeSet {
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

/// What a material is in its places by one set of texture coordinates, cut into parts.
struct Cuts {
    members: Vec<(Material, Place)>,
    nodes: Vec<Node>,
}

enum Node {
    /// Members by their numbers, along what they differ most and from where on; and the sum of the squares of how far they are from their mean, over
    /// the number of all members.
    Part {
        members: Vec<u32>,
        axis: usize,
        middle: f32,
        error: f32,
        code: u8,
    },
    Cut {
        axis: usize,
        middle: f32,
        sides: [usize; 2],
    },
}

impl Cuts {
    fn new(members: Vec<Material>) -> Cuts {
        let members: Vec<(Material, Place)> =
            members.into_iter().map(|material| (material, place(&material))).collect();
        let mut cuts = Cuts { members, nodes: Vec::new() };
        let all = cuts.part((0..cuts.members.len() as u32).collect());
        cuts.nodes.push(all);
        cuts
    }

    fn part(&self, members: Vec<u32>) -> Node {
        let count = members.len().max(1) as f32;
        let along = |axis: usize| {
            let values = || members.iter().map(|&member| self.members[member as usize].1[axis]);
            let mean = values().sum::<f32>() / count;
            (axis, mean, values().map(|value| (value - mean) * (value - mean)).sum::<f32>())
        };
        let spreads: [(usize, f32, f32); size_of::<Place>() / 4] = std::array::from_fn(along);
        let sum: f32 = spreads.iter().map(|spread| spread.2).sum();
        let (axis, middle, _) = spreads.into_iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or_default();
        Node::Part { error: sum / self.members.len().max(1) as f32, members, axis, middle, code: 0 }
    }

    /// The part with the most error, and how much it is.
    fn worst_part(&self) -> Option<(usize, f32)> {
        let error = |(index, node): (usize, &Node)| match node {
            // Finely enough told, if not of many members.
            Node::Part { members, error, .. }
                if *error * self.members.len() as f32 > FINE_ENOUGH * FINE_ENOUGH * members.len() as f32 =>
            {
                Some((index, *error))
            }
            _ => None,
        };
        self.nodes.iter().enumerate().filter_map(error).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn worst(&self) -> f32 {
        self.worst_part().map_or(0.0, |(_, error)| error)
    }

    /// Cuts that part in two.
    fn cut(&mut self) {
        let Some((index, _)) = self.worst_part() else { return };
        let Node::Part { members, axis, middle, .. } = &self.nodes[index] else { return };
        let (axis, middle) = (*axis, *middle);
        let is_less = |member: &&u32| self.members[**member as usize].1[axis] < middle;
        let (less, more): (Vec<&u32>, Vec<&u32>) = members.iter().partition(is_less);
        let parts = [less, more].map(|side| self.part(side.into_iter().copied().collect()));
        let sides = [self.nodes.len(), self.nodes.len() + 1];
        self.nodes.extend(parts);
        self.nodes[index] = Node::Cut { axis, middle, sides };
    }

    /// How many parts there are.
    fn count(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// Numbers the parts from `first` on, so far apart, along the cuts; what each is on the whole.
    fn number(&mut self, first: usize, apart: usize) -> Vec<Material> {
        let (mut stack, mut entries) = (vec![0], Vec::new());
        while let Some(index) = stack.pop() {
            match &mut self.nodes[index] {
                Node::Part { members, code, .. } => {
                    *code = (first + entries.len() * apart) as u8;
                    entries.push(mean(members.iter().map(|&member| &self.members[member as usize].0)));
                }
                Node::Cut { sides: [less, more], .. } => stack.extend([*more, *less]),
            }
        }
        entries
    }

    /// Of the part that a place lies in.
    fn code(&self, place: &Place) -> u8 {
        let mut index = 0;
        loop {
            match &self.nodes[index] {
                Node::Part { code, .. } => return *code,
                Node::Cut { axis, middle, sides } => index = sides[usize::from(place[*axis] >= *middle)],
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_the_same_material() {
        let with = |metallic: f32, occlusion: f32| Material { metallic, occlusion, ..Material::default() };
        let entries = [with(0.0, 0.1), with(0.0, 0.9), with(1.0, 0.1), with(1.0, 0.5), with(1.0, 0.9)];
        let kinds = Kinds::new(vec![3..5, 5..8], 3, &entries);
        assert!(kinds.are_one(3, 4) && kinds.are_one(5, 7) && kinds.are_one(2, 2));
        assert!(!kinds.are_one(4, 5) && !kinds.are_one(1, 2) && !kinds.are_one(2, 3));
        assert_eq!(kinds.mean(&[5, 7]), 6);
        assert_eq!(kinds.mean(&[5, 5, 5, 5, 7]), 5, "0.26 of 0.1, 0.5 and 0.9");
        assert_eq!(kinds.mean(&[3, 4, 4, 4]), 4);
        assert_eq!(kinds.mean(&[2, 2]), 2);
    }
}
