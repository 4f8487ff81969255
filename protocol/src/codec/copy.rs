//! Planes of few distinct values: each sample repeats its neighbour's, the one above, or one of the last seen, or is new.
//!
//! One symbol a sample: 0 the sample to the left (or the only neighbour, or the anchor), 1 the sample above, `2 + i` the `i`th
//! of the values last copied or introduced, [`NEW`] a value of its own in a second stream.

use super::CodecError;
use super::neighbours::{Around, Neighbours};

/// Values remembered.
const RECENT: usize = 30;
const NEW: u8 = 255;

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

/// First and second candidate of a sample, as ranks.
fn candidates(around: Around, rank: usize) -> (Option<usize>, Option<usize>) {
    match around {
        Around::Nothing => (None, None),
        Around::Anchor(anchor) => (Some(anchor), None),
        Around::Left => (Some(rank - 1), None),
        Around::Up(up) => (Some(up), None),
        Around::LeftUp(up) | Around::All(up) => (Some(rank - 1), Some(up)),
    }
}

/// Symbols and new values.
pub(super) fn encode(values: &[u32], neighbours: &Neighbours) -> (Vec<u8>, Vec<u32>) {
    let mut symbols = Vec::with_capacity(values.len());
    let (mut new, mut recent) = (Vec::new(), Recent::new());
    for (rank, &value) in values.iter().enumerate() {
        let (first, second) = candidates(neighbours.around(rank), rank);
        let symbol = if first.is_some_and(|first| values[first] == value) {
            0
        } else if second.is_some_and(|second| values[second] == value) {
            1
        } else if let Some(place) = recent.find(value) {
            recent.take(place);
            place as u8 + 2
        } else {
            recent.add(value);
            new.push(value);
            NEW
        };
        symbols.push(symbol);
    }
    (symbols, new)
}

/// The values of [`encode`]'s symbols, a symbol a sample.
pub(super) fn decode(
    symbols: &[u8],
    mut new: impl Iterator<Item = u32>,
    neighbours: &Neighbours,
) -> Result<Vec<u32>, CodecError> {
    const DAMAGED: CodecError = CodecError::Damaged("copied values");
    let mut values: Vec<u32> = Vec::with_capacity(symbols.len());
    let mut recent = Recent::new();
    for (rank, &symbol) in symbols.iter().enumerate() {
        let (first, second) = candidates(neighbours.around(rank), rank);
        let value = match symbol {
            0 => values[first.ok_or(DAMAGED)?],
            1 => values[second.ok_or(DAMAGED)?],
            NEW => {
                let value = new.next().ok_or(DAMAGED)?;
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
    if new.next().is_none() { Ok(values) } else { Err(DAMAGED) }
}
