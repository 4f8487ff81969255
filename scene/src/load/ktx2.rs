//! KTX2 files with Basis Universal images, ETC1S or UASTC, to RGBA (KTX 2.0 specification, sections 3 and 4).
//!
//! The transcoder takes memory for what the header claims before it looks at the data. So all that it sizes something by
//! is read and checked here first: it must be one plain picture, with levels of the size that its pixels give.

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use image::RgbaImage;

/// First bytes of a KTX2 file.
pub(super) const MAGIC: &[u8] = b"\xABKTX 20\xBB\r\n\x1A\n";

/// The biggest level of a picture of 2^31 pixels a side is the 31st.
const MAX_LEVELS: u32 = 31;
/// Of UASTC, which packs 4 x 4 pixels into 16 bytes.
const BLOCK_SIDE_PX: u64 = 4;
const BLOCK_BYTES: u64 = 16;

/// Width and height in pixels; an error where the file is not one plain picture.
pub(super) fn dimensions(bytes: &[u8]) -> Result<(u32, u32), String> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
        word.map(u32::from_le_bytes).ok_or_else(|| "the KTX2 file ends inside of its header".to_owned())
    };
    let (width, height, depth) = (word(20)?, word(24)?, word(28)?);
    let (layers, faces, levels) = (word(32)?, word(36)?, word(40)?);
    if width == 0 || height == 0 || depth != 0 || layers > 1 || faces != 1 {
        return Err(format!(
            "the KTX2 file is not one plain picture ({width} x {height} x {depth}, layers {layers}, faces {faces})"
        ));
    }
    if levels == 0 || levels > MAX_LEVELS {
        return Err(format!("a KTX2 file of {levels} levels"));
    }
    // 64 bits, of which none of the upper may be set in a level that fits the cap on pixels.
    let (uncompressed_bytes, upper) = (u64::from(word(96)?), word(100)?);
    let blocks = u64::from(width).div_ceil(BLOCK_SIDE_PX) * u64::from(height).div_ceil(BLOCK_SIDE_PX);
    if upper != 0 || uncompressed_bytes > blocks * BLOCK_BYTES {
        return Err("the KTX2 file claims a level larger than its picture".into());
    }
    // Without supercompression it is UASTC, block by block.
    if word(44)? == 0 && blocks * BLOCK_BYTES > bytes.len() as u64 {
        return Err("the KTX2 file is shorter than its picture".into());
    }
    Ok((width, height))
}

/// Decodes the largest level. [`dimensions`] was asked before.
pub(super) fn decode(bytes: &[u8]) -> Result<RgbaImage, String> {
    let transcoder = Transcoder::new(bytes).map_err(|_| "the KTX2 file is damaged, or not of Basis Universal")?;
    if !matches!(transcoder.source_format(), SourceFormat::Etc1s | SourceFormat::UastcLdr) {
        return Err(format!("KTX2 images in {:?} are not supported", transcoder.source_format()));
    }
    let (width, height) = transcoder.base_dimensions();
    let rgba = transcoder
        .transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(|_| "the Basis Universal data of the KTX2 file is damaged")?;
    RgbaImage::from_raw(width, height, rgba).ok_or_else(|| "the picture is not as large as its header says".into())
}
