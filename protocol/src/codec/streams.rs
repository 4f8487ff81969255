//! The byte streams of a patch. First comes the length of each, then all of them, packed in sections of one or more.
//!
//! Streams of one kind of symbol compress best alone, but a section costs some twenty bytes whatever it holds; so short
//! streams share one. Which do, both ends know from the lengths.

use super::CodecError;
use super::pack::{Packer, Unpacker};
use crate::bytes::{EndsEarly, Reader, Writer};

/// A section is closed once it holds this much: there its own overhead is a few percent at most.
const SECTION_BYTES: usize = 1024;

/// Collects streams in the order in which they are read again.
#[derive(Default)]
pub(super) struct StreamWriter {
    lengths: Vec<usize>,
    bytes: Vec<u8>,
}

impl StreamWriter {
    /// Adds a stream and gives it.
    pub fn push_with(&mut self, stream: impl Iterator<Item = u8>) -> &[u8] {
        let start = self.bytes.len();
        self.bytes.extend(stream);
        self.lengths.push(self.bytes.len() - start);
        &self.bytes[start..]
    }

    pub fn push_shorts(&mut self, stream: &[u16]) {
        self.push_with(stream.iter().flat_map(|short| short.to_le_bytes()));
    }

    pub fn write(self, packer: &mut Packer, out: &mut Writer) {
        out.u8(u8::try_from(self.lengths.len()).expect("a patch has a dozen streams"));
        for &length in &self.lengths {
            out.varint(u32::try_from(length).expect("a stream is shorter than 4 GiB"));
        }
        let mut start = 0;
        for length in sections(&self.lengths) {
            packer.pack(&self.bytes[start..start + length], out);
            start += length;
        }
    }
}

/// The lengths of the sections of streams.
fn sections(lengths: &[usize]) -> impl Iterator<Item = usize> + '_ {
    let mut lengths = lengths.iter();
    std::iter::from_fn(move || {
        let mut section = 0;
        while section < SECTION_BYTES {
            match lengths.next() {
                Some(length) => section += length,
                None => return (section > 0).then_some(section),
            }
        }
        Some(section)
    })
}

/// All streams of a patch, unpacked.
pub(super) struct Streams {
    lengths: Vec<usize>,
    sections: Vec<Vec<u8>>,
}

impl Streams {
    /// Unpacks all streams; they hold at most `limit` bytes together.
    pub fn read(bytes: &mut Reader, unpacker: &mut Unpacker, limit: usize) -> Result<Streams, CodecError> {
        let lengths = read_lengths(bytes, limit)?;
        let sections = sections(&lengths).map(|length| unpacker.unpack(bytes, length)).collect::<Result<_, _>>()?;
        Ok(Streams { lengths, sections })
    }

    /// The streams in order.
    pub fn iter(&self) -> StreamIter<'_> {
        StreamIter { lengths: self.lengths.iter(), sections: self.sections.iter(), rest: &[] }
    }
}

/// A count and as many lengths, which sum up to `limit` at most.
fn read_lengths(bytes: &mut Reader, limit: usize) -> Result<Vec<usize>, CodecError> {
    let count = bytes.u8()?;
    let lengths = (0..count).map(|_| bytes.varint().map(|length| length as usize));
    let lengths = lengths.collect::<Result<Vec<usize>, EndsEarly>>()?;
    let sum = lengths.iter().try_fold(0_usize, |sum, &length| sum.checked_add(length));
    match sum {
        Some(sum) if sum <= limit => Ok(lengths),
        _ => Err(CodecError::Damaged("length of the streams")),
    }
}

/// Gives streams in order.
pub(super) struct StreamIter<'a> {
    lengths: std::slice::Iter<'a, usize>,
    sections: std::slice::Iter<'a, Vec<u8>>,
    /// Of the section that the last stream was in.
    rest: &'a [u8],
}

impl<'a> StreamIter<'a> {
    pub fn next(&mut self) -> Result<&'a [u8], CodecError> {
        const TOO_FEW: CodecError = CodecError::Damaged("number of streams");
        let length = *self.lengths.next().ok_or(TOO_FEW)?;
        // A section holds whole streams.
        if self.rest.len() < length {
            self.rest = self.sections.next().ok_or(TOO_FEW)?;
        }
        let (stream, rest) = self.rest.split_at_checked(length).ok_or(TOO_FEW)?;
        self.rest = rest;
        Ok(stream)
    }

    /// The next stream, which holds `length` bytes.
    pub fn next_of(&mut self, length: usize) -> Result<&'a [u8], CodecError> {
        let stream = self.next()?;
        if stream.len() == length { Ok(stream) } else { Err(CodecError::Damaged("length of a stream")) }
    }

    pub fn is_empty(&self) -> bool {
        self.lengths.as_slice().is_empty()
    }
}
