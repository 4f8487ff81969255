//! Decisions with learned probabilities, by an adaptive binary range coder (as in LZMA; Martin, Range encoding, 1979).
//!
//! A model is written once for both directions: it hands each decision to a [`Bits`] and goes on with what comes back. A
//! writer is told the decision and gives it back; a reader ignores what it is told and gives what was written.

/// Probabilities have this many bits when they are used, one more than when a decision costs least.
pub(super) const PROBABILITY_BITS: u32 = 15;
/// Below this range, a byte is written.
const LEAST_RANGE: u32 = 1 << 24;
/// A probability is the mean of two: at their `n`th decision both learn by `1 / (n + 1.5)`, so that they are the mean of what
/// they saw (Krichevsky, Trofimov, 1981), the one that follows changes down to this rate, the other to a slower one.
const QUICK_SHIFT: u32 = 4;
const SLOW_SHIFT: u32 = 7;

const RATES: [u16; (1 << SLOW_SHIFT) - 1] = rates();

/// `1 / (n + 1.5)` for the first `N` decisions, in 1/65536.
pub(super) const fn rates<const N: usize>() -> [u16; N] {
    let mut rates = [0; N];
    let mut seen = 0;
    while seen < N {
        rates[seen] = (131_072 / (2 * seen + 3)) as u16;
        seen += 1;
    }
    rates
}

/// The probability that a decision is `false`, in 1/65536, and how many it has seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Probability {
    quick: u16,
    slow: u16,
    seen: u16,
}

impl Probability {
    pub const EVEN: Probability = Probability { quick: 1 << 15, slow: 1 << 15, seen: 0 };

    /// That a decision is `false`, in [`PROBABILITY_BITS`].
    #[inline(always)]
    fn of_false(self) -> u32 {
        ((u32::from(self.quick) + u32::from(self.slow)) >> 2).max(1)
    }

    #[inline(always)]
    fn learn(&mut self, decision: bool) {
        let slow_rate = u32::from(RATES[usize::from(self.seen)]);
        let quick_rate = slow_rate.max(65_536 >> QUICK_SHIFT);
        let target = if decision { 0 } else { i32::from(u16::MAX) };
        let learn = |value: &mut u16, rate: u32| {
            let step = ((target - i32::from(*value)) * (rate >> 1) as i32) >> 15;
            *value = (i32::from(*value) + step) as u16;
        };
        learn(&mut self.quick, quick_rate);
        learn(&mut self.slow, slow_rate);
        self.seen += u16::from(usize::from(self.seen) < RATES.len() - 1);
    }
}

/// One end of a stream of decisions.
pub(super) trait Bits {
    /// Whether this end knows the decisions.
    const WRITES: bool;

    /// The range that is left.
    fn range(&mut self) -> &mut u32;

    /// Goes into the part of the range below `bound` if a decision is `false`, else above it; gives the decision.
    fn enter(&mut self, bound: u32, decision: bool) -> bool;

    /// Writes or reads a byte.
    fn shift(&mut self);

    /// Codes a decision that is `false` with a probability in [`PROBABILITY_BITS`], neither 0 nor 1; a reader gives the one
    /// that was written, whatever it is told.
    #[inline(always)]
    fn decide(&mut self, of_false: u32, decision: bool) -> bool {
        let bound = (*self.range() >> PROBABILITY_BITS) * of_false;
        let decision = self.enter(bound, decision);
        let range = self.range();
        *range = if decision { *range - bound } else { bound };
        while *self.range() < LEAST_RANGE {
            *self.range() <<= 8;
            self.shift();
        }
        decision
    }

    /// Codes a decision and learns from it.
    #[inline]
    fn bit(&mut self, probability: &mut Probability, decision: bool) -> bool {
        let decision = self.decide(probability.of_false(), decision);
        probability.learn(decision);
        decision
    }

    /// Codes the lowest `count` bits of a value, the highest first, each by those before: a tree of `1 << count` probabilities.
    fn tree(&mut self, tree: &mut [Probability], count: u32, value: u32) -> u32 {
        let read = (0..count).rev().fold(1, |read: u32, place| {
            read << 1 | u32::from(self.bit(&mut tree[read as usize], value >> place & 1 == 1))
        });
        read - (1 << count)
    }

    /// Codes the lowest `count` bits of a value, each as likely as not.
    fn raw(&mut self, value: u32, count: u32) -> u32 {
        (0..count).rev().fold(0, |read, place| {
            read << 1 | u32::from(self.bit(&mut Probability::EVEN.clone(), value >> place & 1 == 1))
        })
    }
}

/// A model of numbers: the place of the highest bit of `number + 1` in unary, then the bits below it, of which the first
/// is learned (Elias' gamma code with learned probabilities).
#[derive(Debug, Clone)]
pub(super) struct Number {
    place: [Probability; 33],
    next: [Probability; 33],
}

impl Number {
    pub const NEW: Number = Number { place: [Probability::EVEN; 33], next: [Probability::EVEN; 33] };

    /// Codes a number below `2^32 - 1`.
    pub fn code(&mut self, bits: &mut impl Bits, number: u32) -> u32 {
        let shifted = u64::from(number) + 1;
        let known = shifted.ilog2();
        let mut place = 0;
        while place < 32 && bits.bit(&mut self.place[place as usize], place < known) {
            place += 1;
        }
        let mut read = 1_u64;
        for below in (0..place).rev() {
            let decision = shifted >> below & 1 == 1;
            let bit = if below + 1 == place {
                bits.bit(&mut self.next[place as usize], decision)
            } else {
                bits.raw(u32::from(decision), 1) == 1
            };
            read = read << 1 | u64::from(bit);
        }
        (read - 1) as u32
    }
}

pub(super) struct BitWriter {
    low: u64,
    range: u32,
    /// The last byte that a carry may still reach, and how many `0xff` follow it.
    held: u8,
    held_count: usize,
    bytes: Vec<u8>,
}

impl BitWriter {
    pub fn new() -> BitWriter {
        BitWriter { low: 0, range: u32::MAX, held: 0, held_count: 0, bytes: Vec::new() }
    }

    pub fn finish(mut self) -> Vec<u8> {
        (0..5).for_each(|_| self.shift());
        // The first byte is the empty one held at the start; zeros at the end are read anyway.
        let used = self.bytes.iter().rposition(|&byte| byte != 0).map_or(1, |last| last + 1).max(1);
        self.bytes[1..used].to_vec()
    }
}

impl Bits for BitWriter {
    const WRITES: bool = true;

    #[inline(always)]
    fn range(&mut self) -> &mut u32 {
        &mut self.range
    }

    #[inline(always)]
    fn enter(&mut self, bound: u32, decision: bool) -> bool {
        self.low += if decision { u64::from(bound) } else { 0 };
        decision
    }

    #[cold]
    fn shift(&mut self) {
        let carry = (self.low >> 32) as u8;
        if carry == 1 || self.low < 0xff00_0000 {
            self.bytes.push(self.held.wrapping_add(carry));
            self.bytes.extend(std::iter::repeat_n(0xff_u8.wrapping_add(carry), self.held_count));
            self.held = (self.low >> 24) as u8;
            self.held_count = 0;
        } else {
            self.held_count += 1;
        }
        self.low = self.low << 8 & 0xffff_ffff;
    }
}

/// Gives the decisions back; past the end of the bytes, zeros are read.
pub(super) struct BitReader<'a> {
    code: u32,
    range: u32,
    bytes: std::slice::Iter<'a, u8>,
}

impl<'a> BitReader<'a> {
    pub fn new(bytes: &'a [u8]) -> BitReader<'a> {
        let mut reader = BitReader { code: 0, range: u32::MAX, bytes: bytes.iter() };
        (0..4).for_each(|_| reader.shift());
        reader
    }
}

impl Bits for BitReader<'_> {
    const WRITES: bool = false;

    #[inline(always)]
    fn range(&mut self) -> &mut u32 {
        &mut self.range
    }

    #[inline(always)]
    fn enter(&mut self, bound: u32, _: bool) -> bool {
        let decision = self.code >= bound;
        self.code -= if decision { bound } else { 0 };
        decision
    }

    #[inline]
    fn shift(&mut self) {
        self.code = self.code << 8 | u32::from(self.bytes.next().copied().unwrap_or(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decisions_come_back() {
        let decisions: Vec<bool> = (0..100_000_u32).map(|i| i.wrapping_mul(2_654_435_761) >> 28 == 0).collect();
        let (mut writer, mut probability) = (BitWriter::new(), Probability::EVEN);
        for &decision in &decisions {
            writer.bit(&mut probability, decision);
        }
        let bytes = writer.finish();
        assert!(bytes.len() < 100_000 / 8 / 2, "one in sixteen costs a third of a bit, not {} bytes", bytes.len());
        let (mut reader, mut probability) = (BitReader::new(&bytes), Probability::EVEN);
        assert!(decisions.iter().all(|&decision| reader.bit(&mut probability, false) == decision));
    }

    #[test]
    fn numbers_come_back_and_small_ones_are_cheap() {
        let numbers: Vec<u32> = (0..2000).map(|i| i % 3).chain([u32::MAX - 1, 1 << 31, 65_535]).collect();
        let (mut writer, mut model) = (BitWriter::new(), Number::NEW);
        numbers.iter().for_each(|&number| assert_eq!(model.code(&mut writer, number), number));
        let bytes = writer.finish();
        assert!(bytes.len() < 2000 / 4 + 30, "a number of three costs 1.6 bits: {} bytes", bytes.len());
        let (mut reader, mut model) = (BitReader::new(&bytes), Number::NEW);
        assert!(numbers.iter().all(|&number| model.code(&mut reader, 0) == number));
    }
}
