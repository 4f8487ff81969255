//! Where surfaces end between the centres of two pixels.
//!
//! A pixel's sample says that its surface is at the pixel's centre, not how far it reaches beyond. Where the surface ends before the centre of
//! the next pixel, before something farther or before nothing, the sample says where: at which fraction of the way between the two
//! centres. It says so for each of its four sides, in three bits of a nibble; 0 says that the surface does not end there: it goes on
//! in the next pixel, in another image, or behind what is nearer. So what is farther never says anything.

use crate::image::{DepthImage, Ranks};

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

/// Asks an image what its samples have beside them. All of it is exact arithmetic: the two ends of a connection agree.
pub struct Neighbours<'a> {
    image: &'a DepthImage,
    ranks: Ranks,
    /// A footprint in depth steps is the code and this, times the next.
    steps_before: f64,
    footprints_a_step: f64,
}

impl<'a> Neighbours<'a> {
    /// Of an image whose mask, depths and objects are known.
    pub fn new(image: &'a DepthImage) -> Neighbours<'a> {
        let (w_min, w_step) = (f64::from(image.depth_scale.w_min), f64::from(image.depth_scale.w_step));
        Neighbours {
            image,
            ranks: Ranks::new(&image.mask),
            steps_before: w_min / w_step,
            footprints_a_step: 1.0 / image.camera.root().focal_px,
        }
    }

    /// The place in the planes of the sample at a pixel beside another.
    pub fn at(&self, (x, y): (u32, u32), [right, down]: [i32; 2]) -> Option<usize> {
        let (x, y) = (x.checked_add_signed(right)?, y.checked_add_signed(down)?);
        self.ranks.of(&self.image.mask, u16::try_from(x).ok()?, u16::try_from(y).ok()?)
    }

    /// What the sample `rank`, at a pixel, has at a side.
    pub fn beside(&self, rank: usize, (x, y): (u32, u32), side: usize) -> Beside {
        let [right, down] = SIDES[side];
        let (width, height) = self.image.mask.size_px();
        let is_inside = |at: Option<u32>, length: u32| at.is_some_and(|at| at < length);
        if !is_inside(x.checked_add_signed(right), width) || !is_inside(y.checked_add_signed(down), height) {
            return Beside::GoesOn;
        }
        let Some(other) = self.at((x, y), SIDES[side]) else { return Beside::Nothing };
        let (own, beside) = (self.image.depth[rank], self.image.depth[other]);
        if self.image.object[rank] != self.image.object[other] {
            return if beside > own { Beside::GoesOn } else { Beside::Other };
        }
        let footprint = (self.steps_before + f64::from(own)) * self.footprints_a_step;
        // Not where depths have no step either.
        if f64::from(own) - f64::from(beside) > footprint { Beside::Farther } else { Beside::GoesOn }
    }
}

impl DepthImage {
    /// Takes the ends of its samples' surfaces, in the order of its planes, but for those that its own samples contradict.
    pub fn settle_ends(&mut self, ends: Vec<Ends>) {
        let neighbours = Neighbours::new(self);
        let settled = |(rank, pixel): (usize, (u32, u32))| {
            let is_shown = |&side: &usize| neighbours.beside(rank, pixel, side) != Beside::GoesOn;
            let shown = |all: Ends, side: usize| with_level(all, side, level(ends[rank], side));
            if ends[rank] == 0 { 0 } else { (0..SIDES.len()).filter(is_shown).fold(0, shown) }
        };
        let settled: Vec<Ends> = self.mask.occupied().enumerate().map(settled).collect();
        self.ends = if settled.iter().all(|&ends| ends == 0) { Vec::new() } else { settled };
    }
}
