//! Sections: bytes that are stored, or compressed by zstd where that is smaller.
//!
//! A section is its form (one byte), the length of what follows (u32), and the bytes. The length of the *unpacked* bytes is
//! never sent: the reader knows it, from the mask or from the section before.

use zstd::bulk::{Compressor, Decompressor};

use super::CodecError;
use crate::bytes::{Reader, Writer};

const STORED: u8 = 0;
const ZSTD: u8 = 1;
/// zstd's fastest ordinary level: the fast profile.
const LEVEL: i32 = 1;
/// A zstd block of 4 bytes or more makes at most 128 KiB (RFC 8878, 3.1.1.2.3), so no honest section unpacks to more than this
/// many times its size; the check keeps allocations in proportion to bytes that really came.
const MAX_EXPANSION: usize = 128 * 1024 / 4;

/// Packs sections, with one compression context for all.
pub(crate) struct Packer(Compressor<'static>);

impl Packer {
    pub fn new() -> Packer {
        Packer(Compressor::new(LEVEL).expect("zstd has its fastest level"))
    }

    /// Appends a section.
    pub fn pack(&mut self, bytes: &[u8], out: &mut Writer) {
        match self.0.compress(bytes) {
            Ok(packed) if packed.len() < bytes.len() => {
                out.u8(ZSTD);
                out.block(&packed);
            }
            _ => {
                out.u8(STORED);
                out.block(bytes);
            }
        }
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
        let form = bytes.u8()?;
        let section = bytes.block()?;
        match form {
            STORED if section.len() == length => Ok(section.to_vec()),
            ZSTD if length <= section.len().saturating_mul(MAX_EXPANSION) => {
                let unpacked = self.0.decompress(section, length).map_err(|_| CodecError::Damaged("section"))?;
                if unpacked.len() == length { Ok(unpacked) } else { Err(CodecError::Damaged("length of a section")) }
            }
            _ => Err(CodecError::Damaged("form of a section")),
        }
    }
}
