//! Decisions whose probability is mixed from what several contexts have seen (logistic mixing: Mahoney, Adaptive weighing of
//! context models for lossless data compression, 2005).
//!
//! All arithmetic is of integers, and so are the tables, so both ends agree to the last bit wherever they run.

use super::bits::{Bits, PROBABILITY_BITS, rates};

/// Contexts that are mixed.
pub(super) const CONTEXTS: usize = 6;
/// Of the mixer: the contexts and one that is always the same, a vector of eight.
const INPUTS: usize = 8;

/// Logarithms of odds count 256ths.
const UNIT: i16 = 256;
/// Logarithms of odds reach from `-LARGEST` to `LARGEST`.
const LARGEST: i32 = 2047;

/// The probability of each logarithm of odds, in 1/65536.
static SQUASH: [u16; 4096] = squash_table();
/// The logarithm of odds of each probability in 1/4096.
static STRETCH: [i16; 4096] = stretch_table();

const fn squash_table() -> [u16; 4096] {
    /// `e^(1 / UNIT)`.
    const STEP: f64 = 1.003_913_889_338_347_5;
    let mut table = [32_768; 4096];
    let (mut odds, mut x) = (1.0, 0);
    while x <= LARGEST {
        let probability = (65_536.0 * odds / (1.0 + odds)) as u16;
        table[(2048 + x) as usize] = probability;
        table[(2048 - x) as usize] = (65_536 - probability as u32) as u16;
        odds *= STEP;
        x += 1;
    }
    table[0] = table[1];
    table
}

const fn stretch_table() -> [i16; 4096] {
    let squash = squash_table();
    let mut table = [0; 4096];
    let (mut x, mut probability) = (0, 0);
    while probability < 4096 {
        while x < 4095 && (squash[x] as usize) < probability * 16 + 8 {
            x += 1;
        }
        table[probability] = x as i16 - 2048;
        probability += 1;
    }
    table
}

/// What a context has seen of a decision: the probability that it is `true` in the upper 22 bits, the highest flipped, and how often it
/// came in the lower 10. Zero where it never came: even.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen(u32);

impl Seen {
    const HALF: u32 = 1 << 31;

    #[inline(always)]
    fn stretched(self) -> i16 {
        STRETCH[((self.0 ^ Seen::HALF) >> 20) as usize]
    }

    #[inline(always)]
    fn learn(&mut self, decision: bool) {
        let state = self.0 ^ Seen::HALF;
        let (probability, count) = (state >> 10, state & SLOWEST);
        let target = if decision { (1 << 22) - 1 } else { 0 };
        // Seven bits less, so that the product fits.
        let step = (((target - probability as i32) >> 7) * i32::from(RATES[count as usize])) >> 9;
        let probability = (probability as i32 + step) as u32;
        self.0 = (probability << 10 | (count + 1).min(SLOWEST)) ^ Seen::HALF;
    }
}

/// A context counts up to here; then it learns by a constant rate.
const SLOWEST: u32 = 127;
/// What a context learns by at its `n`th decision.
static RATES: [u16; SLOWEST as usize + 1] = rates();

/// Weights of the inputs, in 1/8192.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights([i16; INPUTS]);

impl Weights {
    /// Each a quarter: contexts agree with each other, so they sum up to more than one.
    pub const NEW: Weights = Weights([2048; INPUTS]);
}

/// Codes decision `node` of those that contexts have seen: `seen[contexts[i] + node]`.
#[inline(always)]
pub(super) fn decide(
    bits: &mut impl Bits,
    seen: &mut [Seen],
    contexts: &[usize; CONTEXTS],
    node: usize,
    Weights(weights): &mut Weights,
    decision: bool,
) -> bool {
    let mut inputs = [0_i16; INPUTS];
    for (input, context) in inputs.iter_mut().zip(contexts) {
        *input = seen[context + node].stretched();
    }
    inputs[CONTEXTS] = UNIT / 2;
    let sum: i32 = inputs.iter().zip(&*weights).map(|(input, weight)| i32::from(*input) * i32::from(*weight)).sum();
    let mixed = (sum >> 13).clamp(-LARGEST, LARGEST);
    let of_true = i32::from(SQUASH[(mixed + 2048) as usize]);
    let of_false = (65_536 - of_true) as u32 >> (16 - PROBABILITY_BITS);
    let decision = bits.decide(of_false.clamp(1, (1 << PROBABILITY_BITS) - 1), decision);
    let error = ((if decision { 65_535 } else { 0 }) - of_true) >> 1;
    for (input, weight) in inputs.iter().zip(weights) {
        let step = (((i32::from(*input) * error) >> 16) as i16 + 1) >> 1;
        *weight = weight.saturating_add(step);
    }
    for context in contexts {
        seen[context + node].learn(decision);
    }
    decision
}

#[cfg(test)]
mod tests {
    use super::super::bits::{BitReader, BitWriter};
    use super::*;

    /// Codes decisions that the first context foretells and that the others know nothing of.
    fn code(bits: &mut impl Bits, decisions: &[bool]) -> Vec<bool> {
        let (mut seen, mut weights) = (vec![Seen::default(); 2 + CONTEXTS], Weights::NEW);
        let decision = |(index, &decision): (usize, &bool)| {
            let contexts = std::array::from_fn(|kind| if kind == 0 { foretold(index) } else { 1 + kind });
            decide(bits, &mut seen, &contexts, 0, &mut weights, decision)
        };
        decisions.iter().enumerate().map(decision).collect()
    }

    fn foretold(index: usize) -> usize {
        (index as u32).wrapping_mul(2_654_435_761) as usize >> 31
    }

    #[test]
    fn the_context_that_knows_is_heard() {
        let decisions: Vec<bool> = (0..20_000).map(|index| foretold(index) == 1).collect();
        let mut writer = BitWriter::new();
        assert_eq!(code(&mut writer, &decisions), decisions);
        let bytes = writer.finish();
        assert!(bytes.len() < 20_000 / 8 / 20, "{} bytes for what one context knows", bytes.len());
        assert_eq!(code(&mut BitReader::new(&bytes), &vec![false; decisions.len()]), decisions);
    }

    #[test]
    fn odds_and_probabilities_are_inverse() {
        for probability in (8..4088).step_by(8) {
            let back = i32::from(SQUASH[(i32::from(STRETCH[probability]) + 2048) as usize]) / 16;
            assert!((back - probability as i32).abs() <= 8, "{probability} comes back as {back}");
        }
    }
}
