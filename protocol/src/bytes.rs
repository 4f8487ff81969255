//! Hand-laid little-endian bytes: a writer, and a reader that never reads past the end.

use thiserror::Error;

/// The bytes end before the value does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the bytes end early")]
pub struct EndsEarly;

/// Reads values from the front of a slice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Reader<'a> {
        Reader { rest: bytes }
    }

    pub fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], EndsEarly> {
        let (head, rest) = self.rest.split_at_checked(count).ok_or(EndsEarly)?;
        self.rest = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], EndsEarly> {
        let (head, rest) = self.rest.split_first_chunk().ok_or(EndsEarly)?;
        self.rest = rest;
        Ok(*head)
    }

    pub fn u8(&mut self) -> Result<u8, EndsEarly> {
        self.array().map(u8::from_le_bytes)
    }

    pub fn u16(&mut self) -> Result<u16, EndsEarly> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Result<u32, EndsEarly> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, EndsEarly> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn f32(&mut self) -> Result<f32, EndsEarly> {
        self.array().map(f32::from_le_bytes)
    }

    pub fn f64(&mut self) -> Result<f64, EndsEarly> {
        self.array().map(f64::from_le_bytes)
    }

    /// A number of 7 bits a byte, low bits first, at most 32 bits.
    pub fn varint(&mut self) -> Result<u32, EndsEarly> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.u8()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                break;
            }
        }
        Ok(value as u32)
    }

    /// A block of bytes behind its length as u32.
    pub fn block(&mut self) -> Result<&'a [u8], EndsEarly> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    /// A block of bytes behind its length as [`Reader::varint`].
    pub fn varint_block(&mut self) -> Result<&'a [u8], EndsEarly> {
        let length = self.varint()? as usize;
        self.take(length)
    }
}

/// Appends values to a vector.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    pub bytes: Vec<u8>,
}

impl Writer {
    pub fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub fn u16(&mut self, value: u16) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn u32(&mut self, value: u32) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn f32(&mut self, value: f32) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub fn f64(&mut self, value: f64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// See [`Reader::varint`].
    pub fn varint(&mut self, mut value: u32) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    /// See [`Reader::block`].
    pub fn block(&mut self, block: &[u8]) {
        self.u32(u32::try_from(block.len()).expect("blocks stay under 4 GiB"));
        self.bytes.extend_from_slice(block);
    }

    /// See [`Reader::varint_block`].
    pub fn varint_block(&mut self, block: &[u8]) {
        self.varint(u32::try_from(block.len()).expect("blocks stay under 4 GiB"));
        self.bytes.extend_from_slice(block);
    }
}
