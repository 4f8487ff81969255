//! Where surfaces end beside their samples ([`DepthImage::ends`]), for both profiles.
//!
//! Depths and objects are known when this is read, and with them at which sides a surface may end at all: inside of surfaces nothing is
//! coded. At the others a decision says whether it does, and then how far it reaches, both by how the surface ends at the sample before
//! along the outline: above it for what ends to the left or right, else to its left. Many sides are counted first ([`counted`]), for the
//! fast profile; elsewhere decisions learn. Images without any end say so in a decision
//! that next to always comes, at no bytes.

mod counted;

use super::bits::{Bits, Probability};
use crate::ends::{self, Beside, Besides, Ends, SIDES};
use crate::image::DepthImage;

pub(super) use counted::{read, write};

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

/// What is coded of a side: how the surface ends there, and what is known of it before.
#[derive(Debug, Clone, Copy)]
struct Side {
    beside: Beside,
    /// How it ended at the sample before along the outline, and how that differs from the one before it.
    before: usize,
    slope: usize,
    /// Whether it ends at the opposite side.
    across: bool,
}

/// One end of the walk along all sides where surfaces may end.
trait End {
    /// Codes the level of a side, or 0; a reader gives what was written, whatever it is told.
    fn level(&mut self, side: Side, level: u16) -> u16;
}

/// Decisions that learn.
struct Learning<'a, B: Bits> {
    bits: &'a mut B,
    /// Whether a surface ends: by what is beside it, how it ended before, and whether it ends across.
    ends: [[[Probability; 2]; BEFORE]; 4],
    /// How far it reaches: by how it ended before, and how that differed from the one before that; a tree of three bits.
    levels: [[[Probability; 8]; SLOPES]; BEFORE],
}

impl<B: Bits> End for Learning<'_, B> {
    fn level(&mut self, Side { beside, before, slope, across }: Side, level: u16) -> u16 {
        if !self.bits.bit(&mut self.ends[beside as usize][before][usize::from(across)], level > 0) {
            return 0;
        }
        self.bits.tree(&mut self.levels[before][slope], 3, level.into()) as u16
    }
}

/// What is known before the first side is coded.
struct Begun {
    besides: Besides,
    /// Whether no surface ends where the image's own samples say that it goes on.
    is_settled: bool,
}

/// Codes whether there are any ends.
fn begin(bits: &mut impl Bits, image: &DepthImage, ends: &[Ends]) -> Option<Begun> {
    bits.decide(NONE, !ends.is_empty()).then(|| {
        let besides = Besides::of(image);
        let is_settled = bits.raw(u32::from(is_settled(&besides, ends)), 1) == 1;
        Begun { besides, is_settled }
    })
}

/// Codes the plane of an image whose other planes are known by decisions alone; a writer hands in `ends`, a reader nothing.
pub(super) fn code(bits: &mut impl Bits, image: &DepthImage, ends: Vec<Ends>) -> Vec<Ends> {
    match begin(bits, image, &ends) {
        Some(begun) => by_learning(bits, image, ends, &begun),
        None => Vec::new(),
    }
}

fn by_learning(bits: &mut impl Bits, image: &DepthImage, ends: Vec<Ends>, begun: &Begun) -> Vec<Ends> {
    let even = Probability::EVEN;
    let mut learning = Learning { bits, ends: [[[even; 2]; BEFORE]; 4], levels: [[[even; 8]; SLOPES]; BEFORE] };
    walk(image, ends, begun, &mut learning)
}

/// Goes through all sides where a surface may end.
fn walk(image: &DepthImage, mut ends: Vec<Ends>, begun: &Begun, end: &mut impl End) -> Vec<Ends> {
    ends.resize(image.sample_count(), 0);
    let (width_px, height_px) = image.mask.size_px();
    let mut columns = Columns::new(width_px);
    let mut rank = 0;
    for y in 0..height_px {
        columns.begin_row();
        image.mask.runs(y, |run| {
            let (ranks, pixels) = (rank..rank + run.len(), run.start as usize..run.end as usize);
            rank = ranks.end;
            columns.rows[0][pixels.clone()].iter_mut().zip(ranks.clone()).for_each(|(to, rank)| *to = rank as u32);
            let all = ranks.zip(pixels);
            for (rank, x) in all.filter(|&(rank, _)| !(begun.is_settled && begun.besides.goes_on_around(rank))) {
                ends[rank] = sample(image, begun, &ends, (rank, x), &columns, end);
            }
        });
    }
    ends
}

/// Codes where the surface of a sample in a column ends.
#[inline(always)]
fn sample(
    image: &DepthImage,
    Begun { besides, is_settled }: &Begun,
    ends: &[Ends],
    (rank, x): (usize, usize),
    columns: &Columns,
    end: &mut impl End,
) -> Ends {
    let object = image.object[rank];
    let mut coded = 0;
    for side in 0..SIDES.len() {
        let beside = besides.at(rank, side);
        if beside == Beside::GoesOn && *is_settled {
            continue;
        }
        let before = |steps| columns.before(x, side, steps).filter(|&before| image.object[before] == object);
        let (before, slope) = how_before(besides, ends, before, side);
        let across = side >= 2 && ends::level(coded, side - 2) > 0;
        let level = end.level(Side { beside, before, slope, across }, ends::level(ends[rank], side));
        coded = ends::with_level(coded, side, level);
    }
    coded
}

/// How the surface ends at the same side of the sample before along the outline, and how that differs from the one before it.
#[inline(always)]
fn how_before(
    besides: &Besides,
    ends: &[Ends],
    before: impl Fn(usize) -> Option<usize>,
    side: usize,
) -> (usize, usize) {
    let Some(first) = before(1) else { return (NO_SAMPLE, 0) };
    let level = ends::level(ends[first], side);
    if level == 0 {
        return (if besides.at(first, side) == Beside::GoesOn { GOES_ON } else { MAY_END }, 0);
    }
    let slope = match before(2).map_or(0, |second| ends::level(ends[second], side)) {
        0 => 0,
        earlier if earlier > level + 1 => 1,
        earlier if level > earlier + 1 => 3,
        _ => 2,
    };
    (FIRST_LEVEL + usize::from(level), slope)
}

/// Whether no surface ends where the image's own samples say that it goes on.
fn is_settled(besides: &Besides, ends: &[Ends]) -> bool {
    ends.iter().enumerate().filter(|(_, ends)| **ends != 0).all(|(rank, &ends)| {
        let is_right = |side| ends::level(ends, side) == 0 || besides.at(rank, side) != Beside::GoesOn;
        (0..SIDES.len()).all(is_right)
    })
}

/// The ranks of the samples in this row, in the one above it, and in the one above that.
struct Columns {
    rows: [Vec<u32>; 3],
}

impl Columns {
    const NONE: u32 = u32::MAX;

    fn new(width_px: u32) -> Columns {
        Columns { rows: [(); 3].map(|()| vec![Columns::NONE; width_px as usize]) }
    }

    fn begin_row(&mut self) {
        self.rows.rotate_right(1);
        self.rows[0].fill(Columns::NONE);
    }

    /// The sample so many steps before the one in a column: above it for what ends to the left or right, else to its left.
    #[inline(always)]
    fn before(&self, x: usize, side: usize, steps: usize) -> Option<usize> {
        let is_across = SIDES[side][0] != 0;
        let rank = if is_across { self.rows[steps][x] } else { *self.rows[0].get(x.wrapping_sub(steps))? };
        (rank != Columns::NONE).then_some(rank as usize)
    }
}
