//! An entropy coder for bytes with contexts: range asymmetric numeral systems (Duda, Asymmetric numeral systems, 2013; the
//! table form with 16-bit renormalization as in Giesen, Interleaved entropy coders, 2014), with one frequency table a
//! context.
//!
//! Unlike Huffman codes, which zstd uses, a likely symbol takes less than a bit, and the frequencies may depend on what lies
//! around the sample. Tables travel with the data; contexts are merged where they are too few symbols to pay for a table each.

use super::CodecError;
use super::streams::{StreamIter, StreamWriter};
use crate::bytes::{Reader, Writer};

/// Frequencies of a table sum up to `2^SCALE_BITS`: tables stay in the fastest cache, at a loss below a thousandth.
const SCALE_BITS: u32 = 11;
const SCALE: u32 = 1 << SCALE_BITS;
/// States stay in `[LEAST, LEAST << 16)`.
const LEAST: u32 = 1 << 16;
/// Bits that a symbol's frequency costs in a table, about, for the choice of merging.
const TABLE_ENTRY_BITS: f64 = 7.0;
/// By how much context numbers may be divided: none merged, some, all.
const MERGES: [u8; 3] = [1, 4, u8::MAX];

/// Collects symbols in order, each with its context (below 64).
#[derive(Default)]
pub(super) struct SymbolWriter {
    contexts: Vec<u8>,
    symbols: Vec<u8>,
}

impl SymbolWriter {
    pub fn with_capacity(count: usize) -> SymbolWriter {
        SymbolWriter { contexts: Vec::with_capacity(count), symbols: Vec::with_capacity(count) }
    }

    pub fn push(&mut self, context: u8, symbol: u8) {
        self.contexts.push(context);
        self.symbols.push(symbol);
    }

    /// What these symbols cost without their tables, in bits.
    pub fn cost_bits(&self) -> f64 {
        self.histograms().iter().map(entropy_bits).sum()
    }

    fn histograms(&self) -> Vec<[u32; 256]> {
        let mut counts = vec![[0_u32; 256]; usize::from(self.contexts.iter().copied().max().unwrap_or(0)) + 1];
        for (&context, &symbol) in self.contexts.iter().zip(&self.symbols) {
            counts[usize::from(context)][usize::from(symbol)] += 1;
        }
        counts
    }

    /// Appends tables to the packed streams and the code to the coded ones.
    pub fn write(&self, streams: &mut StreamWriter) {
        let full = self.histograms();
        let merged = MERGES.map(|merge| (merge, merged(&full, merge)));
        let cost = |histograms: &Vec<[u32; 256]>| {
            let entry = |count: &&u32| **count > 0;
            let entries: usize = histograms.iter().map(|counts| counts.iter().filter(entry).count()).sum();
            histograms.iter().map(entropy_bits).sum::<f64>() + entries as f64 * TABLE_ENTRY_BITS
        };
        let best = merged.iter().min_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1)));
        let (merge, histograms) = best.expect("there are three");
        let tables: Vec<Frequencies> = histograms.iter().map(Frequencies::new).collect();
        let mut head = Writer::default();
        head.u8(*merge);
        head.u8(u8::try_from(tables.len()).expect("contexts are below 64"));
        tables.iter().for_each(|table| table.write(&mut head));
        streams.push(&head.bytes);
        streams.push_coded(&self.code(*merge, &tables));
    }

    fn code(&self, merge: u8, tables: &[Frequencies]) -> Vec<u8> {
        let mut words: Vec<u16> = Vec::with_capacity(self.symbols.len() / 2 + 2);
        let mut state = LEAST;
        for (&context, &symbol) in self.contexts.iter().zip(&self.symbols).rev() {
            let table = &tables[usize::from(context / merge)];
            let (frequency, start) = (table.frequency[usize::from(symbol)], table.start[usize::from(symbol)]);
            if u64::from(state) >= u64::from(frequency) << (32 - SCALE_BITS) {
                words.push(state as u16);
                state >>= 16;
            }
            state = ((state / frequency) << SCALE_BITS) + state % frequency + start;
        }
        words.extend([state as u16, (state >> 16) as u16]);
        words.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
    }
}

fn merged(full: &[[u32; 256]], merge: u8) -> Vec<[u32; 256]> {
    let mut merged = vec![[0; 256]; (full.len() - 1) / usize::from(merge) + 1];
    for (context, counts) in full.iter().enumerate() {
        let sum = &mut merged[context / usize::from(merge)];
        sum.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    merged
}

fn entropy_bits(counts: &[u32; 256]) -> f64 {
    let total: u32 = counts.iter().sum();
    let bits = |&count: &u32| f64::from(count) * (f64::from(total) / f64::from(count)).log2();
    counts.iter().filter(|count| **count > 0).map(bits).sum()
}

/// The table of one context: frequencies that sum up to [`SCALE`], and the sum of those before.
struct Frequencies {
    frequency: [u32; 256],
    start: [u32; 256],
}

impl Frequencies {
    fn new(counts: &[u32; 256]) -> Frequencies {
        let total = u64::from(counts.iter().sum::<u32>().max(1));
        let scaled = |&count: &u32| {
            let share = (u64::from(count) * u64::from(SCALE) / total) as u32;
            if count > 0 { share.max(1) } else { 0 }
        };
        let mut frequency: [u32; 256] = std::array::from_fn(|symbol| scaled(&counts[symbol]));
        if total == 1 && counts.iter().all(|&count| count == 0) {
            frequency[0] = SCALE;
        }
        // The largest take up the rounding.
        loop {
            let sum: u32 = frequency.iter().sum();
            let largest = frequency.iter_mut().max().expect("256 symbols");
            match sum.cmp(&SCALE) {
                std::cmp::Ordering::Equal => break,
                std::cmp::Ordering::Less => *largest += SCALE - sum,
                std::cmp::Ordering::Greater => *largest -= (sum - SCALE).min(*largest / 2),
            }
        }
        Frequencies { frequency, start: starts(&frequency) }
    }

    fn write(&self, out: &mut Writer) {
        let used = self.frequency.iter().rposition(|&frequency| frequency > 0).expect("they sum up to more than 0");
        out.u8(used as u8);
        self.frequency[..=used].iter().for_each(|&frequency| out.varint(frequency));
    }
}

fn starts(frequency: &[u32; 256]) -> [u32; 256] {
    let mut sum = 0;
    frequency.map(|frequency| {
        sum += frequency;
        sum - frequency
    })
}

/// For each of the [`SCALE`] slots of a context: the symbol (8 bits), its frequency (12) and the slot's place in it (12).
type Slots = [u32; SCALE as usize];

fn read_slots(bytes: &mut Reader) -> Result<Box<Slots>, CodecError> {
    const DAMAGED: CodecError = CodecError::Damaged("frequencies");
    let used = bytes.u8()?;
    let mut slots = Box::new([0; SCALE as usize]);
    let mut filled = 0;
    for symbol in 0..=u32::from(used) {
        let frequency = bytes.varint()?;
        let range = slots[filled..].get_mut(..frequency as usize).ok_or(DAMAGED)?;
        for (place, slot) in range.iter_mut().enumerate() {
            *slot = symbol << 24 | frequency << 12 | place as u32;
        }
        filled += frequency as usize;
    }
    if filled == slots.len() { Ok(slots) } else { Err(DAMAGED) }
}

/// Gives symbols back, one at a time.
pub(super) struct SymbolReader<'a> {
    merge: u8,
    tables: Vec<Box<Slots>>,
    words: std::slice::Iter<'a, [u8; 2]>,
    state: u32,
}

impl<'a> SymbolReader<'a> {
    /// Reads what [`SymbolWriter::write`] wrote, for `contexts` contexts.
    pub fn read(streams: &mut StreamIter<'a>, contexts: u8) -> Result<SymbolReader<'a>, CodecError> {
        let mut head = Reader::new(streams.next()?);
        let (merge, count) = (head.u8()?, head.u8()?);
        if merge == 0 || count == 0 || count > contexts {
            return Err(CodecError::Damaged("contexts"));
        }
        let tables = (0..count).map(|_| read_slots(&mut head)).collect::<Result<Vec<_>, CodecError>>()?;
        let mut words = streams.next_coded()?.as_chunks().0.iter();
        let mut word = || words.next().map(|word| u32::from(u16::from_le_bytes(*word)));
        let (high, low) = (word(), word());
        let (Some(high), Some(low)) = (high, low) else { return Err(CodecError::Damaged("code")) };
        Ok(SymbolReader { merge, tables, words, state: high << 16 | low })
    }

    /// The next symbol. Past the end of the code, any; [`SymbolReader::finish`] tells.
    pub fn next(&mut self, context: u8) -> u8 {
        let table = usize::from(context / self.merge).min(self.tables.len() - 1);
        let slot = self.tables[table][(self.state & (SCALE - 1)) as usize];
        self.state = (slot >> 12 & 0xfff).wrapping_mul(self.state >> SCALE_BITS).wrapping_add(slot & 0xfff);
        if self.state < LEAST {
            let word = self.words.next().map_or(0, |word| u32::from(u16::from_le_bytes(*word)));
            self.state = self.state << 16 | word;
        }
        (slot >> 24) as u8
    }

    /// Whether exactly the code was read.
    pub fn finish(self) -> Result<(), CodecError> {
        if self.state == LEAST && self.words.len() == 0 { Ok(()) } else { Err(CodecError::Damaged("code")) }
    }
}
