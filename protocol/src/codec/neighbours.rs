//! Which samples a sample may be predicted from.
//!
//! Neighbours are the samples of the same object at the pixels to the left, above, and above to both sides. A hole, or another
//! object, is no neighbour: no prediction reaches across a silhouette. A sample without neighbours starts from an *anchor*,
//! the last sample of its object that came before it in row-major order, which repeats its colour and its normal more often
//! than the sample before it does.

use crate::image::Mask;

/// What a sample has to its left and above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Around {
    /// The very first sample.
    Nothing,
    /// No neighbour: the anchor.
    Anchor(usize),
    /// Only the sample to the left (the one before).
    Left,
    /// Only the sample above, or where there is none either, the one above to the left or right.
    Up(usize),
    /// Both, and a hole or another object above to the left.
    LeftUp(usize),
    /// All three; the one above to the left lies just before the one above.
    All(usize),
}

const KIND_SHIFT: u32 = 29;
const RANK_MASK: u32 = (1 << KIND_SHIFT) - 1;
const ANCHOR: u32 = 0;
const LEFT: u32 = 1;
const UP: u32 = 2;
const LEFT_UP: u32 = 3;
const ALL: u32 = 4;
const NOTHING: u32 = 5;

/// [`Around`] of every sample, packed: the kind in the upper three bits, a rank in the others.
pub(super) struct Neighbours(Vec<u32>);

impl Neighbours {
    /// The neighbours of the samples of a mask, by their objects.
    pub fn new(mask: &Mask, object: &[u16]) -> Neighbours {
        let width_px = mask.size_px().0 as usize;
        let mut around = Vec::with_capacity(object.len());
        let mut last_of_object = vec![u32::MAX; object.iter().max().map_or(0, |&most| usize::from(most) + 1)];
        // Rank + 1 of the sample at each column of the row above, 0 for a hole; and of this row so far.
        let (mut above, mut here) = (vec![0_u32; width_px + 2], vec![0_u32; width_px + 2]);
        let mut row = 0;
        let mut touched = (Vec::new(), Vec::new());
        for (rank, (x, y)) in mask.occupied().enumerate() {
            let x = x as usize;
            while row < y {
                row += 1;
                for column in touched.0.drain(..) {
                    above[column] = 0_u32;
                }
                std::mem::swap(&mut above, &mut here);
                std::mem::swap(&mut touched.0, &mut touched.1);
            }
            // Columns are shifted by one, so that those beside the image are holes.
            here[x + 1] = rank as u32 + 1;
            touched.1.push(x + 1);
            let own = object[rank];
            let same = |slot: u32| slot != 0 && object[slot as usize - 1] == own;
            let (left, up, corner) = (same(here[x]), same(above[x + 1]), same(above[x]));
            let up_rank = above[x + 1].wrapping_sub(1);
            let packed = match (left, up) {
                (true, true) if corner => ALL << KIND_SHIFT | up_rank,
                (true, true) => LEFT_UP << KIND_SHIFT | up_rank,
                (true, false) => LEFT << KIND_SHIFT,
                (false, true) => UP << KIND_SHIFT | up_rank,
                (false, false) if corner => UP << KIND_SHIFT | (above[x] - 1),
                (false, false) if same(above[x + 2]) => UP << KIND_SHIFT | (above[x + 2] - 1),
                (false, false) => match last_of_object[usize::from(own)] {
                    u32::MAX if rank == 0 => NOTHING << KIND_SHIFT,
                    u32::MAX => ANCHOR << KIND_SHIFT | (rank as u32 - 1),
                    last => ANCHOR << KIND_SHIFT | last,
                },
            };
            around.push(packed);
            last_of_object[usize::from(own)] = rank as u32;
        }
        Neighbours(around)
    }

    pub fn around(&self, rank: usize) -> Around {
        let packed = self.0[rank];
        let other = (packed & RANK_MASK) as usize;
        match packed >> KIND_SHIFT {
            ANCHOR => Around::Anchor(other),
            LEFT => Around::Left,
            UP => Around::Up(other),
            LEFT_UP => Around::LeftUp(other),
            ALL => Around::All(other),
            _ => Around::Nothing,
        }
    }
}

/// The median edge detector of LOCO-I (Weinberger, Seroussi, Sapiro 2000, §III.A): at an edge the neighbour on this side of
/// it, elsewhere the plane through the three.
pub(super) fn median_edge(left: i32, up: i32, corner: i32) -> i32 {
    (left + up - corner).clamp(left.min(up), left.max(up))
}
