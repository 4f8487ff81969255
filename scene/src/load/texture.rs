//! Images to textures: PNG and JPEG, decoded in parallel with a cap on their pixels.

use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};

use image::{ImageFormat, ImageReader, Limits, RgbaImage};
use rayon::prelude::*;

use super::{Request, Stage};

/// Memory that a decoder may take beside its output: JPEG keeps coefficients, 16 bit PNG doubles its output.
const DECODER_BYTES_PER_PIXEL: u64 = 16;
/// Larger images fit no texture of the adapters that this program is for.
const MAX_SIDE_PX: u32 = 16_384;

/// Decodes images in parallel; `None` is one that nothing needs. A fault is a message for the log, never a failure of
/// the scene: what uses the image is drawn without it.
pub(super) fn decode_all(images: &[Option<&[u8]>], request: &Request<'_>) -> Vec<Option<Result<RgbaImage, String>>> {
    let wanted = images.iter().flatten().count();
    let done = AtomicUsize::new(0);
    // Sizes are summed in the files' order before any pixel is decoded, so that the same images are left out every time.
    let mut pixels_left = request.limits.texture_pixels;
    let admitted: Vec<_> = images.iter().map(|image| image.map(|bytes| admit(bytes, &mut pixels_left))).collect();
    admitted
        .into_par_iter()
        .map(|image| {
            let result = image?.and_then(|(bytes, format)| decode(bytes, format));
            request.report(Stage::Textures, done.fetch_add(1, Ordering::Relaxed) + 1, wanted);
            Some(result)
        })
        .collect()
}

/// The format of an image whose pixels fit what is left of the budget.
fn admit<'a>(bytes: &'a [u8], pixels_left: &mut u64) -> Result<(&'a [u8], ImageFormat), String> {
    let format = image::guess_format(bytes).map_err(|_| "not a PNG or JPEG image".to_owned())?;
    if !matches!(format, ImageFormat::Png | ImageFormat::Jpeg) {
        return Err(format!("{} images are not supported, only PNG and JPEG", format.extensions_str()[0]));
    }
    let (width, height) =
        ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(|error| error.to_string())?;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(format!("{width} x {height} pixels is more than {MAX_SIDE_PX} on a side"));
    }
    let pixels = u64::from(width) * u64::from(height);
    if pixels > *pixels_left {
        return Err(format!("{width} x {height} pixels is past what is left of the limit on texture pixels"));
    }
    *pixels_left -= pixels;
    Ok((bytes, format))
}

fn decode(bytes: &[u8], format: ImageFormat) -> Result<RgbaImage, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE_PX);
    limits.max_image_height = Some(MAX_SIDE_PX);
    limits.max_alloc = Some(u64::from(MAX_SIDE_PX) * u64::from(MAX_SIDE_PX) * DECODER_BYTES_PER_PIXEL);
    reader.limits(limits);
    Ok(reader.decode().map_err(|error| error.to_string())?.into_rgba8())
}
