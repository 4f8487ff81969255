//! Planes of few distinct values: each sample repeats its neighbour's, the one above, or one of the last seen, or is new.
//!
//! One symbol a sample: 0 the sample to the left (or the only neighbour, or the anchor), 1 the sample above, `2 + i` the `i`th
//! of the values last copied or introduced, [`NEW`] a value of its own, in a second stream as its difference from the first. A symbol's context is whether the
//! three neighbours agree, and what the sample before it did.

use super::CodecError;
use super::neighbours::{Around, Neighbours};
use super::rans::{SymbolReader, SymbolWriter};
use super::streams::{StreamIter, StreamWriter};

/// Values remembered.
const RECENT: usize = 30;
const NEW: u8 = 255;
/// Eight ways in which neighbours agree, by three ways in which the sample before was coded.
const CONTEXTS: u8 = 8 * 3;

/// The values last copied from the list or introduced, the newest first.
struct Recent {
    values: [u32; RECENT],
    count: usize,
}

impl Recent {
    fn new() -> Recent {
        Recent { values: [0; RECENT], count: 0 }
    }

    fn find(&self, value: u32) -> Option<usize> {
        self.values[..self.count].iter().position(|&recent| recent == value)
    }

    fn add(&mut self, value: u32) {
        self.count = (self.count + 1).min(RECENT);
        self.values[..self.count].rotate_right(1);
        self.values[0] = value;
    }

    fn take(&mut self, place: usize) -> u32 {
        self.values[..=place].rotate_right(1);
        self.values[0]
    }
}

/// First and second candidate of a sample, as ranks, and how far they agree.
fn candidates(values: &[u32], around: Around, rank: usize) -> (Option<usize>, Option<usize>, u8) {
    match around {
        Around::Nothing => (None, None, 0),
        Around::Anchor(anchor) => (Some(anchor), None, 0),
        Around::Left => (Some(rank - 1), None, 1),
        Around::Up(up) => (Some(up), None, 2),
        Around::LeftUp(up) => (Some(rank - 1), Some(up), if values[rank - 1] == values[up] { 3 } else { 4 }),
        Around::All(up) => {
            let (left, above, corner) = (values[rank - 1], values[up], values[up - 1]);
            let agreement = match (left == above, left == corner, above == corner) {
                (true, true, _) => 3,
                (false, true, _) => 5,
                (false, _, true) => 6,
                (true, false, _) => 7,
                (false, false, false) => 4,
            };
            (Some(rank - 1), Some(up), agreement)
        }
    }
}

/// A new value as the difference of each byte from the first candidate's, zigzagged: small where values change little.
fn difference(value: u32, from: u32) -> u32 {
    let (value, from) = (value.to_le_bytes(), from.to_le_bytes());
    u32::from_le_bytes(std::array::from_fn(|byte| {
        let difference = value[byte].wrapping_sub(from[byte]);
        difference << 1 ^ (difference as i8 >> 7) as u8
    }))
}

/// The inverse of [`difference`].
fn sum(difference: u32, from: u32) -> u32 {
    let (difference, from) = (difference.to_le_bytes(), from.to_le_bytes());
    u32::from_le_bytes(std::array::from_fn(|byte| {
        from[byte].wrapping_add(difference[byte] >> 1 ^ (difference[byte] & 1).wrapping_neg())
    }))
}

/// A plane as symbols and new values.
pub(super) struct Copied {
    symbols: SymbolWriter,
    new: Vec<u32>,
    value_bytes: usize,
}

/// Codes values of `value_bytes` bytes each.
pub(super) fn encode(values: &[u32], value_bytes: usize, neighbours: &Neighbours) -> Copied {
    let mut symbols = SymbolWriter::with_capacity(values.len());
    let (mut new, mut recent, mut last) = (Vec::new(), Recent::new(), 0);
    for (rank, &value) in values.iter().enumerate() {
        let (first, second, agreement) = candidates(values, neighbours.around(rank), rank);
        let symbol = if first.is_some_and(|first| values[first] == value) {
            0
        } else if second.is_some_and(|second| values[second] == value) {
            1
        } else if let Some(place) = recent.find(value) {
            recent.take(place);
            place as u8 + 2
        } else {
            recent.add(value);
            new.push(difference(value, first.map_or(0, |first| values[first])));
            NEW
        };
        symbols.push(agreement * 3 + last, symbol);
        last = symbol.min(2);
    }
    Copied { symbols, new, value_bytes }
}

impl Copied {
    pub fn cost_bits(&self) -> f64 {
        self.symbols.cost_bits() + (self.new.len() * self.value_bytes * 8) as f64
    }

    pub fn write(&self, streams: &mut StreamWriter) {
        self.symbols.write(streams);
        for byte in 0..self.value_bytes {
            streams.push(&self.new.iter().map(|value| value.to_le_bytes()[byte]).collect::<Vec<u8>>());
        }
    }
}

/// The `count` values of [`Copied::write`]'s streams.
pub(super) fn decode(
    count: usize,
    value_bytes: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<u32>, CodecError> {
    const DAMAGED: CodecError = CodecError::Damaged("copied values");
    let mut symbols = SymbolReader::read(streams, CONTEXTS)?;
    let mut new: Vec<u32> = streams.next()?.iter().map(|&byte| byte.into()).collect();
    for byte in 1..value_bytes {
        let plane = streams.next_of(new.len())?;
        new.iter_mut().zip(plane).for_each(|(value, &bits)| *value |= u32::from(bits) << (8 * byte));
    }
    let mut new = new.into_iter();
    let mut values: Vec<u32> = Vec::with_capacity(count);
    let (mut recent, mut last) = (Recent::new(), 0);
    for rank in 0..count {
        let (first, second, agreement) = candidates(&values, neighbours.around(rank), rank);
        let symbol = symbols.next(agreement * 3 + last);
        last = symbol.min(2);
        let value = match symbol {
            0 => values[first.ok_or(DAMAGED)?],
            1 => values[second.ok_or(DAMAGED)?],
            NEW => {
                let value = sum(new.next().ok_or(DAMAGED)?, first.map_or(0, |first| values[first]));
                recent.add(value);
                value
            }
            place => {
                let place = usize::from(place - 2);
                if place >= recent.count {
                    return Err(DAMAGED);
                }
                recent.take(place)
            }
        };
        values.push(value);
    }
    symbols.finish()?;
    if new.next().is_none() { Ok(values) } else { Err(DAMAGED) }
}
