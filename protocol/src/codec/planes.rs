//! The samples of a patch: the mask, then every plane.

use super::CodecError;
use super::header::Header;
use super::pack::{Packer, Unpacker};
use crate::bytes::{Reader, Writer};
use crate::held::Patch;
use crate::image::{DepthImage, Mask};
use crate::limits::Limits;

pub(super) fn write(image: &DepthImage, packer: &mut Packer, out: &mut Writer) {
    let mask: Vec<u8> = image.mask.words().iter().flat_map(|word| word.to_le_bytes()).collect();
    packer.pack(&mask, out);
    let shorts = |values: &[u16]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    packer.pack(&shorts(&image.depth), out);
    packer.pack(image.normal.as_flattened(), out);
    packer.pack(image.colour.as_flattened(), out);
    packer.pack(&shorts(&image.object), out);
    packer.pack(&image.material, out);
}

pub(super) fn read(
    header: Header,
    unpacker: &mut Unpacker,
    bytes: &mut Reader,
    limits: &Limits,
) -> Result<Patch, CodecError> {
    let (width_px, height_px) = header.camera.size_px();
    let pixels = width_px as usize * height_px as usize;
    if pixels > limits.update_pixels {
        return Err(CodecError::TooMuch("pixels"));
    }
    let words = unpacker.unpack(bytes, pixels.div_ceil(64) * 8)?;
    let words = words.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect();
    let mask = Mask::from_words(width_px, height_px, words).ok_or(CodecError::Damaged("mask"))?;
    let count = mask.count();
    if count > limits.update_samples {
        return Err(CodecError::TooMuch("samples"));
    }
    let shorts = |values: Vec<u8>| values.as_chunks().0.iter().map(|short| u16::from_le_bytes(*short)).collect();
    let image = DepthImage {
        camera: header.camera,
        depth_scale: header.depth_scale,
        depth: shorts(unpacker.unpack(bytes, count * 2)?),
        normal: unpacker.unpack(bytes, count * 2)?.as_chunks().0.to_vec(),
        colour: unpacker.unpack(bytes, count * 3)?.as_chunks().0.to_vec(),
        object: shorts(unpacker.unpack(bytes, count * 2)?),
        material: unpacker.unpack(bytes, count)?,
        mask,
    };
    let Header { id, purpose, capture_time_s, objects, .. } = header;
    Ok(Patch { id, purpose, capture_time_s, objects, image })
}
