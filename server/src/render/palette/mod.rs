//! Materials that vary from place to place, in the table of materials.
//!
//! A sample refers to a material by one byte. Where textures say how rough, metallic or bright a surface is, place by place, that byte tells it
//! too: what the textures of a material say together is cut into as many parts as the table has room for, and each part is an entry, the mean of its
//! members. Parts are cut in two where they are widest, along one of their numbers, the part with the most error first (Heckbert, *Color image
//! quantization for frame buffer display*, 1982; by variance as Wan, Wong, Prusinkiewicz, 1988), until entries are as near to their members as
//! `FINE_ENOUGH`. So a sample costs no plane more, all that lights samples works as it is, and a scene of materials that do not vary has one
//! byte that is the same everywhere, which is no byte. Entries are numbered along the cuts: codes that are near stand for what is alike.
//!
//! Which entry lies where is looked up on the GPU in a texture of codes, whose every level is made of the same level of the textures: codes
//! themselves have no mean.
//!
//! Textures by the second set of coordinates of a mesh meet those of the first anywhere. Each set's are cut into parts of their own, and every pair of
//! parts is an entry; there are two textures of codes then, and a surface has the sum of both.

mod cuts;
mod kinds;
mod place;
mod source;

use std::ops::Range;

use gpu::MaterialUniform;
use protocol::Material;
use rayon::prelude::*;
use scene::Scene;
use scene::model::UvSet;

pub use kinds::Kinds;
pub(crate) use place::on_the_whole;
pub(crate) use source::CodeSet;

use cuts::Cuts;
use place::take;
use source::Source;

/// Sides of textures of codes at most, and texels of all of them together.
const MAX_SIDE_PX: u32 = 2048;
/// See [`MAX_SIDE_PX`].
const MAX_TEXELS: usize = 1 << 28;

/// Where the codes of a material lie.
#[derive(Debug, Clone)]
pub(crate) struct CodeMap {
    /// By set of texture coordinates; one of them at least.
    pub sets: [Option<CodeSet>; 2],
    /// Which there are.
    pub codes: Range<usize>,
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
