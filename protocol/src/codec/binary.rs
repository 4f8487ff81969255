//! An adaptive binary range coder (as in LZMA; Martin, Range encoding, 1979): each decision has a probability that learns from
//! the decisions before it. For masks, where decisions are few and certain and tables would not pay.

/// Probabilities have this many bits.
const PROBABILITY_BITS: u32 = 12;
/// How fast they learn: by 1/32 of the surprise.
const LEARNING_SHIFT: u32 = 5;
/// Below this range, a byte is written.
const LEAST_RANGE: u32 = 1 << 24;

/// The probability that a decision is `false`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Probability(u16);

impl Probability {
    pub const EVEN: Probability = Probability(1 << (PROBABILITY_BITS - 1));

    fn bound(self, range: u32) -> u32 {
        (range >> PROBABILITY_BITS) * u32::from(self.0)
    }

    fn learn(&mut self, decision: bool) {
        if decision {
            self.0 -= self.0 >> LEARNING_SHIFT;
        } else {
            self.0 += ((1 << PROBABILITY_BITS) - self.0) >> LEARNING_SHIFT;
        }
    }
}

pub(super) struct BinaryWriter {
    low: u64,
    range: u32,
    /// The last byte that a carry may still reach, and how many `0xff` follow it.
    held: u8,
    held_count: usize,
    bytes: Vec<u8>,
}

impl BinaryWriter {
    pub fn new() -> BinaryWriter {
        BinaryWriter { low: 0, range: u32::MAX, held: 0, held_count: 0, bytes: Vec::new() }
    }

    pub fn push(&mut self, probability: &mut Probability, decision: bool) {
        let bound = probability.bound(self.range);
        if decision {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        probability.learn(decision);
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.shift();
        }
    }

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

    pub fn finish(mut self) -> Vec<u8> {
        (0..5).for_each(|_| self.shift());
        // The first byte is the empty one held at the start; zeros at the end are read anyway.
        let used = self.bytes.iter().rposition(|&byte| byte != 0).map_or(1, |last| last + 1).max(1);
        self.bytes[1..used].to_vec()
    }
}

/// Gives the decisions back; past the end of the bytes, zeros are read.
pub(super) struct BinaryReader<'a> {
    code: u32,
    range: u32,
    bytes: std::slice::Iter<'a, u8>,
}

impl<'a> BinaryReader<'a> {
    pub fn new(bytes: &'a [u8]) -> BinaryReader<'a> {
        let mut reader = BinaryReader { code: 0, range: u32::MAX, bytes: bytes.iter() };
        (0..4).for_each(|_| reader.shift());
        reader
    }

    fn shift(&mut self) {
        self.code = self.code << 8 | u32::from(self.bytes.next().copied().unwrap_or(0));
    }

    pub fn next(&mut self, probability: &mut Probability) -> bool {
        let bound = probability.bound(self.range);
        let decision = self.code >= bound;
        if decision {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        probability.learn(decision);
        while self.range < LEAST_RANGE {
            self.range <<= 8;
            self.shift();
        }
        decision
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decisions_come_back() {
        let decisions: Vec<bool> = (0..100_000_u32).map(|i| i.wrapping_mul(2_654_435_761) >> 28 == 0).collect();
        let (mut writer, mut probability) = (BinaryWriter::new(), Probability::EVEN);
        decisions.iter().for_each(|&decision| writer.push(&mut probability, decision));
        let bytes = writer.finish();
        assert!(bytes.len() < 100_000 / 8 / 2, "one in sixteen costs a third of a bit, not {} bytes", bytes.len());
        let (mut reader, mut probability) = (BinaryReader::new(&bytes), Probability::EVEN);
        assert!(decisions.iter().all(|&decision| reader.next(&mut probability) == decision));
    }
}
