//! Residuals for the dense profile and for small patches: each by decisions that learn, so that there are no tables to send.
//!
//! A residual is zigzagged and coded as the place of its highest bit, in unary, and the bits below. What the decisions learn is
//! kept apart by how large the neighbours' residuals were (as in CALIC: Wu, Memon, Context-based, adaptive, lossless image
//! coding, 1997, §IV), and that of the channel before.

use super::bits::{Bits, Probability};
use super::residual::{unzigzag, zigzag};
use super::segments::{Around, Segment};

/// Sizes of the neighbours' residuals told apart, and one for samples without neighbours.
const LEVELS: usize = 17;
/// Sizes of the channel before.
const LINKS: usize = 5;
/// Bits of `code + 1`.
const PLACES: usize = 17;

struct Model {
    place: [Probability; PLACES],
    next: [Probability; PLACES],
    second: [[Probability; 2]; PLACES],
}

impl Model {
    const NEW: Model = Model {
        place: [Probability::EVEN; PLACES],
        next: [Probability::EVEN; PLACES],
        second: [[Probability::EVEN; 2]; PLACES],
    };

    #[inline(always)]
    fn code(&mut self, bits: &mut impl Bits, code: u16) -> u16 {
        let shifted = u32::from(code) + 1;
        let known = shifted.ilog2() as usize;
        let mut place = 0;
        while place < PLACES - 1 && bits.bit(&mut self.place[place], place < known) {
            place += 1;
        }
        let mut read = 1_u32;
        for below in (0..place).rev() {
            let decision = shifted >> below & 1 == 1;
            let bit = match place - below {
                1 => bits.bit(&mut self.next[place], decision),
                2 => bits.bit(&mut self.second[place][(read & 1) as usize], decision),
                _ => bits.raw(decision.into(), 1) == 1,
            };
            read = read << 1 | u32::from(bit);
        }
        (read - 1) as u16
    }
}

/// The level of a sum of four neighbours' codes: about twice as fine as powers of two.
fn level(sum: u32) -> usize {
    match sum {
        0..=3 => sum as usize,
        _ => {
            let place = sum.ilog2();
            (2 * place as usize + (sum >> (place - 1) & 1) as usize).min(LEVELS - 2)
        }
    }
}

/// Codes the residuals of a plane; a reader fills them.
pub(super) fn code<const N: usize, B: Bits>(bits: &mut B, residuals: &mut [[i16; N]], segments: &[Segment]) {
    let mut models: Vec<Model> = (0..N * LEVELS * LINKS).map(|_| Model::NEW).collect();
    let mut codes = vec![[0_u16; N]; residuals.len()];
    let mut sample = |codes: &mut [u16; N], residual: &mut [i16; N], level: [usize; N]| {
        let mut link = 0;
        for channel in 0..N {
            let model = &mut models[(channel * LEVELS + level[channel]) * LINKS + link];
            let code = model.code(bits, zigzag(residual[channel]));
            codes[channel] = code;
            residual[channel] = unzigzag(code);
            link = ((u32::from(code) + 1).ilog2() as usize).div_ceil(2).min(LINKS - 2) + 1;
        }
    };
    for segment in segments {
        for (step, rank) in segment.ranks().enumerate() {
            let (before, here) = codes.split_at_mut(rank);
            let other = segment.other as usize + step;
            let at = |rank: usize, c: usize| u32::from(before[rank][c]);
            let levels = std::array::from_fn(|c| match segment.around {
                Around::Nothing | Around::Anchor => LEVELS - 1,
                Around::Up => level(4 * at(segment.other as usize, c)),
                Around::Left => level(4 * at(rank - 1, c)),
                Around::LeftUp => level(2 * at(rank - 1, c) + 2 * at(other, c)),
                Around::All => level(2 * at(rank - 1, c) + at(other, c) + at(other + 1, c)),
            });
            sample(&mut here[0], &mut residuals[rank], levels);
        }
    }
}
