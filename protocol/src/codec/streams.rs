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
    pub fn push(&mut self, stream: &[u8]) {
        self.lengths.push(stream.len());
        self.bytes.extend_from_slice(stream);
    }

    pub fn push_shorts(&mut self, stream: &[u16]) {
        self.lengths.push(stream.len() * 2);
        self.bytes.extend(stream.iter().flat_map(|short| short.to_le_bytes()));
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
    bytes: Vec<u8>,
}

impl Streams {
    /// Unpacks all streams; they hold at most `limit` bytes together.
    pub fn read(bytes: &mut Reader, unpacker: &mut Unpacker, limit: usize) -> Result<Streams, CodecError> {
        let lengths = read_lengths(bytes, limit)?;
        let mut unpacked = Vec::new();
        for section in sections(&lengths) {
            unpacker.unpack_onto(bytes, section, &mut unpacked)?;
        }
        Ok(Streams { lengths, bytes: unpacked })
    }

    /// The streams in order.
    pub fn iter(&self) -> StreamIter<'_> {
        StreamIter { lengths: self.lengths.iter(), rest: &self.bytes }
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
    rest: &'a [u8],
}

impl<'a> StreamIter<'a> {
    pub fn next(&mut self) -> Result<&'a [u8], CodecError> {
        let length = *self.lengths.next().ok_or(CodecError::Damaged("number of streams"))?;
        let (stream, rest) = self.rest.split_at(length);
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
