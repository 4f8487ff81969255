//! Where surfaces end between the centres of two pixels.
//!
//! A pixel's sample says that its surface is at the pixel's centre, not how far it reaches beyond. Where the surface ends before the centre of
//! the next pixel, before something farther or before nothing, the sample says where: at which fraction of the way between the two
//! centres. It says so for each of its four sides, in three bits of a nibble; 0 says that the surface does not end there: it goes on
//! in the next pixel, in another image, or behind what is nearer. So what is farther never says anything.

mod beside;
#[cfg(test)]
pub(crate) use beside::tests;

use crate::image::DepthImage;

pub use crate::image::Ends;

/// The next pixel to the right, below, to the left, and above, in the order of the nibbles from the lowest on.
pub const SIDES: [[i32; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// The greatest level. Of nine equal parts of the way the first and the last belong to the centres: a surface that ends
/// covers `level + 0.5` of them.
pub const MOST: u16 = 7;

/// The level of a side; 0 where the surface does not end.
pub fn level(ends: Ends, side: usize) -> u16 {
    ends >> (4 * side) & MOST
}

/// With the level of a side, which had none.
pub fn with_level(ends: Ends, side: usize, level: u16) -> Ends {
    ends | level.min(MOST) << (4 * side)
}

/// Where a surface ends on its way to the next pixel's centre, 0 to 1; `None` where it does not.
pub fn reach(ends: Ends, side: usize) -> Option<f32> {
    match level(ends, side) {
        0 => None,
        level => Some((f32::from(level) + 0.5) / 9.0),
    }
}

/// What a sample has at a side, as far as its image tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// A sample of the same surface, or a nearer one, or no pixel of the image: no surface is seen to end.
    GoesOn,
    /// No sample.
    Nothing,
    /// A sample of another object, not nearer.
    Other,
    /// A sample of the same object, farther by more than a footprint.
    Farther,
}

/// What all samples of an image have beside them. All of it is exact arithmetic: the two ends of a connection agree.
pub struct Besides {
    /// By sample, two bits a side.
    codes: Vec<u8>,
}

impl Beside {
    /// By code.
    const ALL: [Beside; 4] = [Beside::GoesOn, Beside::Nothing, Beside::Other, Beside::Farther];
}

impl Besides {
    /// Of an image whose mask, depths and objects are known.
    pub fn of(image: &DepthImage) -> Besides {
        Besides { codes: beside::codes(image) }
    }

    /// What a sample has at a side.
    #[inline(always)]
    pub fn at(&self, rank: usize, side: usize) -> Beside {
        Beside::ALL[usize::from(self.codes[rank] >> (2 * side) & 3)]
    }

    /// At how many sides a surface may end.
    pub fn side_count(&self) -> usize {
        self.codes.iter().map(|code| ((code | code >> 1) & 0b0101_0101).count_ones() as usize).sum()
    }

    /// Whether a sample's surface goes on at all sides.
    #[inline(always)]
    pub fn goes_on_around(&self, rank: usize) -> bool {
        self.codes[rank] == 0
    }
}

impl DepthImage {
    /// Takes the ends of its samples' surfaces, in the order of its planes, but for those that its own samples contradict.
    pub fn settle_ends(&mut self, mut ends: Vec<Ends>) {
        let besides = Besides::of(self);
        for (rank, ends) in ends.iter_mut().enumerate().filter(|(_, ends)| **ends != 0) {
            let is_shown = |&side: &usize| besides.at(rank, side) != Beside::GoesOn;
            let shown = |all: Ends, side: usize| with_level(all, side, level(*ends, side));
            *ends = (0..SIDES.len()).filter(is_shown).fold(0, shown);
        }
        self.ends = if ends.iter().all(|&ends| ends == 0) { Vec::new() } else { ends };
    }
}
