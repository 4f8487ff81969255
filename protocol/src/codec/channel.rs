//! Residuals of one channel of a plane: the difference of a value from its prediction, zigzagged; a byte each, and what does not
//! fit a byte in a second stream of shorts. The context of a residual is how large those of its neighbours were (as in
//! CALIC: Wu, Memon, Context-based, adaptive, lossless image coding, 1997, §IV).

use super::CodecError;
use super::neighbours::Around;
use super::rans::{SymbolReader, SymbolWriter};
use super::streams::{StreamIter, StreamWriter};

/// In the byte stream: look in the second one.
const ESCAPE: u8 = 255;

/// Contexts of a residual.
const CONTEXTS: u8 = 2 * LEVELS + 1;
/// The context of a sample without neighbours.
const ALONE: u8 = CONTEXTS - 1;
/// Sizes of residuals told apart.
const LEVELS: u8 = 15;

/// The context for each sum of two neighbours' codes: about equally many bits apart.
#[inline]
fn level(energy: u32) -> u8 {
    match energy {
        0..=6 => energy as u8,
        7..=9 => 7,
        10..=13 => 8,
        14..=19 => 9,
        20..=28 => 10,
        29..=42 => 11,
        43..=64 => 12,
        65..=110 => 13,
        _ => 14,
    }
}

/// The context of a sample by the codes of its neighbours, to which `extra` adds what other channels tell.
#[inline]
fn context(around: Around, rank: usize, codes: &[u8], extra: u32) -> u8 {
    let code = |rank: usize| u32::from(codes[rank]);
    match around {
        Around::Nothing | Around::Anchor(_) => ALONE,
        Around::Left => LEVELS + level(2 * code(rank - 1) + extra),
        Around::Up(up) => LEVELS + level(2 * code(up) + extra),
        Around::LeftUp(up) | Around::All(up) => level(code(rank - 1) + code(up) + extra),
    }
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn zigzag(value: i16) -> u16 {
    (value << 1 ^ value >> 15) as u16
}

fn unzigzag(code: u16) -> i16 {
    (code >> 1) as i16 ^ -((code & 1) as i16)
}

/// What both ends remember of a channel's samples so far.
struct Memory {
    codes: Vec<u8>,
    /// Values wrap at this many bits: 8 or 16.
    bits: u32,
}

impl Memory {
    fn wrap(&self, value: i32) -> i32 {
        let unused = 32 - self.bits;
        value << unused >> unused
    }
}

/// Collects the values of a channel.
pub(super) struct ChannelWriter {
    memory: Memory,
    symbols: SymbolWriter,
    escaped: Vec<u16>,
}

impl ChannelWriter {
    /// For the samples from rank `first` on, of `count`; those before count as predicted without an error. Values wrap at
    /// `bits`, 8 or 16.
    pub fn starting_at(first: usize, count: usize, bits: u32) -> ChannelWriter {
        let mut codes = Vec::with_capacity(count);
        codes.resize(first, 0);
        ChannelWriter {
            memory: Memory { codes, bits },
            symbols: SymbolWriter::with_capacity(count - first),
            escaped: Vec::new(),
        }
    }

    /// The next sample's value; gives its code, from which other channels take their `extra`.
    #[inline]
    pub fn push(&mut self, around: Around, extra: u32, predicted: i32, value: i32) -> u8 {
        let memory = &mut self.memory;
        let context = context(around, memory.codes.len(), &memory.codes, extra);
        let residual = memory.wrap(value - predicted);
        let wide = zigzag(residual as i16);
        let code = if wide < u16::from(ESCAPE) { wide as u8 } else { ESCAPE };
        if code == ESCAPE {
            self.escaped.push(wide);
        }
        memory.codes.push(code);
        self.symbols.push(context, code);
        code
    }

    pub fn cost_bits(&self) -> f64 {
        self.symbols.cost_bits() + self.escaped.len() as f64 * 16.0
    }

    pub fn write(&self, streams: &mut StreamWriter) {
        self.symbols.write(streams);
        streams.push_shorts(&self.escaped);
    }
}

/// Reads them again.
pub(super) struct ChannelReader<'a> {
    memory: Memory,
    symbols: SymbolReader<'a>,
    escaped: std::slice::Iter<'a, [u8; 2]>,
}

impl<'a> ChannelReader<'a> {
    pub fn read(streams: &mut StreamIter<'a>, count: usize, bits: u32) -> Result<ChannelReader<'a>, CodecError> {
        let symbols = SymbolReader::read(streams, CONTEXTS)?;
        let memory = Memory { codes: Vec::with_capacity(count), bits };
        Ok(ChannelReader { memory, symbols, escaped: streams.next()?.as_chunks().0.iter() })
    }

    /// The next sample's code and value; of the value only the lowest bits, as many as wrap, are meant.
    #[inline]
    pub fn next(&mut self, around: Around, extra: u32, predicted: i32) -> Result<(u8, i32), CodecError> {
        let memory = &mut self.memory;
        let context = context(around, memory.codes.len(), &memory.codes, extra);
        let code = self.symbols.next(context);
        memory.codes.push(code);
        let wide = match code {
            ESCAPE => u16::from_le_bytes(*self.escaped.next().ok_or(CodecError::Damaged("residuals"))?),
            code => code.into(),
        };
        let residual = i32::from(unzigzag(wide));
        Ok((code, predicted + residual))
    }

    /// Whether exactly what was written was read.
    pub fn finish(self) -> Result<(), CodecError> {
        self.symbols.finish()?;
        if self.escaped.len() == 0 { Ok(()) } else { Err(CodecError::Damaged("residuals")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zigzag_is_reversible() {
        assert!((i16::MIN..=i16::MAX).all(|value| unzigzag(zigzag(value)) == value));
    }
}
