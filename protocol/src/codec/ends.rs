//! Where surfaces end beside their samples ([`DepthImage::ends`]), for both profiles.
//!
//! Depths and objects are known when this is read, and with them at which sides a surface may end at all: inside of surfaces nothing is
//! coded. At the others a decision says whether it does, and then how far it reaches, both by how the surface ends at the sample before
//! along the outline: above it for what ends to the left or right, else to its left. Images without any end say so in a decision
//! that next to always comes, at no bytes.

use super::bits::{Bits, Probability};
use crate::ends::{self, Beside, Ends, Neighbours, SIDES};
use crate::image::DepthImage;

/// That an image has none, in 1/32768.
const NONE: u32 = 32_700;

/// How the surface ends at the sample before: by level, and where there is none.
const BEFORE: usize = ends::MOST as usize + 3;
const NO_SAMPLE: usize = 0;
const GOES_ON: usize = 1;
const MAY_END: usize = 2;
const FIRST_LEVEL: usize = 2;

/// How the two before differ.
const SLOPES: usize = 4;

struct Model {
    /// Whether a surface ends: by what is beside it, how it ended before, and whether it ends across.
    ends: [[[Probability; 2]; BEFORE]; 4],
    /// How far it reaches: by how it ended before, and how that differed from the one before that; a tree of three bits.
    levels: [[[Probability; 8]; SLOPES]; BEFORE],
}

/// Codes the plane of an image whose other planes are known; a writer hands in `ends`, a reader nothing.
pub(super) fn code(bits: &mut impl Bits, image: &DepthImage, mut ends: Vec<Ends>) -> Vec<Ends> {
    if !bits.decide(NONE, !ends.is_empty()) {
        return Vec::new();
    }
    ends.resize(image.sample_count(), 0);
    let neighbours = Neighbours::new(image);
    let is_settled = bits.raw(u32::from(is_settled(image, &neighbours, &ends)), 1) == 1;
    let even = Probability::EVEN;
    let mut model = Model { ends: [[[even; 2]; BEFORE]; 4], levels: [[[even; 8]; SLOPES]; BEFORE] };
    for (rank, pixel) in image.mask.occupied().enumerate() {
        let mut coded = 0;
        for side in 0..SIDES.len() {
            let beside = neighbours.beside(rank, pixel, side);
            if beside == Beside::GoesOn && is_settled {
                continue;
            }
            let [before, slope] = before(image, &neighbours, &ends, (rank, pixel), side);
            let across = side >= 2 && ends::level(coded, side - 2) > 0;
            let level = ends::level(ends[rank], side);
            let model_ends = &mut model.ends[beside as usize][before][usize::from(across)];
            if bits.bit(model_ends, level > 0) {
                let level = bits.tree(&mut model.levels[before][slope], 3, level.into());
                coded = ends::with_level(coded, side, level as u16);
            }
        }
        ends[rank] = coded;
    }
    ends
}

/// Whether no surface ends where the image's own samples say that it goes on.
fn is_settled(image: &DepthImage, neighbours: &Neighbours<'_>, ends: &[Ends]) -> bool {
    image.mask.occupied().zip(ends).enumerate().all(|(rank, (pixel, &ends))| {
        let is_right = |side| ends::level(ends, side) == 0 || neighbours.beside(rank, pixel, side) != Beside::GoesOn;
        ends == 0 || (0..SIDES.len()).all(is_right)
    })
}

/// How the surface ends at the same side of the sample before along the outline, and how that differs from the one before it.
fn before(
    image: &DepthImage,
    neighbours: &Neighbours<'_>,
    ends: &[Ends],
    (rank, (x, y)): (usize, (u32, u32)),
    side: usize,
) -> [usize; 2] {
    let [right, down] = SIDES[side];
    let back = [-down.abs(), -right.abs()];
    let same = |before: &usize| image.object[*before] == image.object[rank];
    let Some(first) = neighbours.at((x, y), back).filter(same) else { return [NO_SAMPLE, 0] };
    let level = ends::level(ends[first], side);
    if level == 0 {
        let first_pixel = (x.wrapping_add_signed(back[0]), y.wrapping_add_signed(back[1]));
        let goes_on = neighbours.beside(first, first_pixel, side) == Beside::GoesOn;
        return [if goes_on { GOES_ON } else { MAY_END }, 0];
    }
    let second = neighbours.at((x, y), back.map(|step| 2 * step)).filter(same);
    let slope = match second.map_or(0, |second| ends::level(ends[second], side)) {
        0 => 0,
        earlier if earlier > level + 1 => 1,
        earlier if level > earlier + 1 => 3,
        _ => 2,
    };
    [FIRST_LEVEL + usize::from(level), slope]
}
