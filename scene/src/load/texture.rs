//! Images to textures: PNG, JPEG, WebP and KTX2 (Basis Universal), decoded in parallel with a cap on their pixels.

use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};

use image::{ImageFormat, ImageReader, Limits, RgbaImage};
use rayon::prelude::*;

use super::guard::guarded;
use super::{Request, Stage, ktx2};

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
            let result = image?.and_then(|(bytes, codec)| codec.decode(bytes));
            request.report(Stage::Textures, done.fetch_add(1, Ordering::Relaxed) + 1, wanted);
            Some(result)
        })
        .collect()
}

/// What an image is decoded by.
#[derive(Debug, Clone, Copy)]
enum Codec {
    Ktx2,
    Image(ImageFormat),
}

impl Codec {
    fn of(bytes: &[u8]) -> Result<Codec, String> {
        if bytes.starts_with(ktx2::MAGIC) {
            return Ok(Codec::Ktx2);
        }
        match image::guess_format(bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => Ok(Codec::Image(format)),
            Ok(format) => {
                Err(format!("{} images are not supported, only PNG, JPEG, WebP and KTX2", format.extensions_str()[0]))
            }
            Err(_) => Err("not a PNG, JPEG, WebP or KTX2 image".into()),
        }
    }

    fn dimensions(self, bytes: &[u8]) -> Result<(u32, u32), String> {
        match self {
            Codec::Ktx2 => ktx2::dimensions(bytes),
            Codec::Image(format) => guarded(|| {
                let reader = ImageReader::with_format(Cursor::new(bytes), format);
                reader.into_dimensions().map_err(|error| error.to_string())
            }),
        }
    }

    fn decode(self, bytes: &[u8]) -> Result<RgbaImage, String> {
        guarded(|| match self {
            Codec::Ktx2 => ktx2::decode(bytes),
            Codec::Image(format) => decode_image(bytes, format),
        })
    }
}

/// The codec of an image whose pixels fit what is left of the budget.
fn admit<'a>(bytes: &'a [u8], pixels_left: &mut u64) -> Result<(&'a [u8], Codec), String> {
    let codec = Codec::of(bytes)?;
    let (width, height) = codec.dimensions(bytes)?;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(format!("{width} x {height} pixels is more than {MAX_SIDE_PX} on a side"));
    }
    let pixels = u64::from(width) * u64::from(height);
    if pixels > *pixels_left {
        return Err(format!("{width} x {height} pixels is past what is left of the limit on texture pixels"));
    }
    *pixels_left -= pixels;
    Ok((bytes, codec))
}

fn decode_image(bytes: &[u8], format: ImageFormat) -> Result<RgbaImage, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE_PX);
    limits.max_image_height = Some(MAX_SIDE_PX);
    limits.max_alloc = Some(u64::from(MAX_SIDE_PX) * u64::from(MAX_SIDE_PX) * DECODER_BYTES_PER_PIXEL);
    reader.limits(limits);
    Ok(reader.decode().map_err(|error| error.to_string())?.into_rgba8())
}
