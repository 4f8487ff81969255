//! Sections: bytes that are stored, or compressed by zstd where that is smaller.
//!
//! A section is a variable-length number, twice the length of what follows plus one if it is compressed, and the bytes. The
//! length of the *unpacked* bytes is never sent: the reader knows it, from the mask or from lengths it has checked.

use zstd::bulk::{Compressor, Decompressor};
use zstd::zstd_safe::CParameter;

use super::CodecError;
use crate::bytes::{Reader, Writer};

/// zstd's fastest ordinary level: the fast profile.
const LEVEL: i32 = 1;
/// Its strongest ordinary level, some fifty times slower.
const THOROUGH_LEVEL: i32 = 19;
/// A zstd block of 4 bytes or more makes at most 128 KiB (RFC 8878, 3.1.1.2.3), so no honest section unpacks to more than this
/// many times its size; the check keeps allocations in proportion to bytes that really came.
const MAX_EXPANSION: usize = 128 * 1024 / 4;

/// Packs sections, with one compression context for all.
pub(crate) struct Packer(Compressor<'static>);

impl Packer {
    pub fn new() -> Packer {
        Packer::at(LEVEL)
    }

    /// For what is sent once.
    pub fn thorough() -> Packer {
        Packer::at(THOROUGH_LEVEL)
    }

    fn at(level: i32) -> Packer {
        let mut compressor = Compressor::new(level).expect("zstd has its ordinary levels");
        compressor.set_parameter(CParameter::ContentSizeFlag(false)).expect("zstd can leave the size out");
        Packer(compressor)
    }

    /// Appends a section.
    pub fn pack(&mut self, bytes: &[u8], out: &mut Writer) {
        let packed = self.0.compress(bytes).ok().filter(|packed| packed.len() < bytes.len());
        let section = packed.as_deref().unwrap_or(bytes);
        let length = u32::try_from(section.len()).ok().filter(|length| *length < 1 << 31);
        out.varint(length.expect("sections stay under 2 GiB") << 1 | u32::from(packed.is_some()));
        out.bytes.extend_from_slice(section);
    }
}

/// Unpacks sections, with one context for all.
pub(crate) struct Unpacker(Decompressor<'static>);

impl Unpacker {
    pub fn new() -> Unpacker {
        Unpacker(Decompressor::new().expect("a decompression context has no conditions"))
    }

    /// Reads a section that holds exactly `length` bytes. The caller has checked `length` against its limits.
    pub fn unpack(&mut self, bytes: &mut Reader, length: usize) -> Result<Vec<u8>, CodecError> {
        let head = bytes.varint()?;
        let section = bytes.take((head >> 1) as usize)?;
        if head & 1 == 0 {
            return if section.len() == length {
                Ok(section.to_vec())
            } else {
                Err(CodecError::Damaged("length of a section"))
            };
        }
        if length > section.len().saturating_mul(MAX_EXPANSION) {
            return Err(CodecError::Damaged("length of a section"));
        }
        let unpacked = self.0.decompress(section, length).map_err(|_| CodecError::Damaged("section"))?;
        if unpacked.len() == length { Ok(unpacked) } else { Err(CodecError::Damaged("section")) }
    }
}
