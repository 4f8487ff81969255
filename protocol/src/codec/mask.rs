//! The mask: which pixels hold a sample.

use super::CodecError;
use super::pack::{Packer, Unpacker};
use crate::bytes::{Reader, Writer};
use crate::image::Mask;
use crate::limits::Limits;

pub(super) fn write(mask: &Mask, packer: &mut Packer, out: &mut Writer) {
    let bytes: Vec<u8> = mask.words().iter().flat_map(|word| word.to_le_bytes()).collect();
    packer.pack(&bytes, out);
}

pub(super) fn read(
    (width_px, height_px): (u32, u32),
    unpacker: &mut Unpacker,
    bytes: &mut Reader,
    limits: &Limits,
) -> Result<Mask, CodecError> {
    let pixels = width_px as usize * height_px as usize;
    if pixels > limits.update_pixels {
        return Err(CodecError::TooMuch("pixels"));
    }
    let words = unpacker.unpack(bytes, pixels.div_ceil(64) * 8)?;
    let words = words.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect();
    Mask::from_words(width_px, height_px, words).ok_or(CodecError::Damaged("mask"))
}
