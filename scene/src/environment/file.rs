//! Environments as files. Bytes are not trusted: what a header claims is checked before anything of that size is made.

use std::fs::File;
use std::io::{BufWriter, Cursor, Read};
use std::path::Path;

use exr::meta::{BlockDescription, MetaData};
use image::codecs::hdr::{HdrDecoder, HdrEncoder};
use image::codecs::openexr::OpenExrDecoder;
use image::{DynamicImage, ImageDecoder, ImageResult, Rgb};

use super::{Environment, EnvironmentError};

/// Bytes of a file at most: as many as the most pixels take as floats of four channels.
const MAX_FILE_BYTES: u64 = Environment::MAX_PIXELS * 16;
/// A header that claims more lies: a run of a Radiance file is of 127 pixels at most, and deflate, which OpenEXR uses on at least 3
/// bytes a pixel, makes a byte of no more than 1032.
const MAX_PIXELS_A_BYTE: u64 = 1032 / 3;
/// What a block of an OpenEXR file may unpack to, whatever the file's size: a tile of 1024 x 1024 pixels of four floats may be larger than its picture.
const MAX_BLOCK_BYTES: u64 = 1024 * 1024 * 16;
/// How a Radiance file begins; older writers wrote the second.
const HDR_SIGNATURES: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];
/// How an OpenEXR file begins.
const EXR_SIGNATURE: &[u8] = &[0x76, 0x2f, 0x31, 0x01];

impl Environment {
    /// Reads a Radiance or OpenEXR file, told apart by content. Negative and undefined values become 0, and values past
    /// [`Environment::MAX_RADIANCE`] are cut.
    pub fn load(path: &Path) -> Result<Environment, EnvironmentError> {
        let io = |source| EnvironmentError::Io { path: path.to_owned(), source };
        let mut bytes = Vec::new();
        File::open(path).map_err(io)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(EnvironmentError::TooLarge { path: path.to_owned(), limit: MAX_FILE_BYTES });
        }
        Environment::decode(&bytes, path)
    }

    /// The same from the bytes of a file; `path` is what errors name.
    pub fn decode(bytes: &[u8], path: &Path) -> Result<Environment, EnvironmentError> {
        let malformed =
            |error: image::ImageError| EnvironmentError::Malformed { path: path.to_owned(), reason: error.to_string() };
        if HDR_SIGNATURES.iter().any(|signature| bytes.starts_with(signature)) {
            // Not strictly: that knows the first signature only.
            return read_pixels(HdrDecoder::new_nonstrict(Cursor::new(bytes)), bytes.len(), path, malformed);
        }
        if bytes.starts_with(EXR_SIGNATURE) {
            check_blocks(bytes).map_err(|reason| EnvironmentError::Malformed { path: path.to_owned(), reason })?;
            let decoder = OpenExrDecoder::with_alpha_preference(Cursor::new(bytes), Some(false));
            return read_pixels(decoder, bytes.len(), path, malformed);
        }
        Err(EnvironmentError::UnknownFormat { path: path.to_owned() })
    }

    /// Writes a Radiance file: three mantissas of 8 bits and one exponent a pixel, so within half a percent of the largest
    /// channel.
    pub fn write_hdr(&self, path: &Path) -> Result<(), EnvironmentError> {
        let io = |source| EnvironmentError::Io { path: path.to_owned(), source };
        let pixels: Vec<Rgb<f32>> = self.radiance.iter().map(|&pixel| Rgb(pixel)).collect();
        let file = BufWriter::new(File::create(path).map_err(io)?);
        let encoded = HdrEncoder::new(file).encode(&pixels, self.width_px as usize, self.height_px as usize);
        encoded.map_err(|error| io(std::io::Error::other(error)))
    }
}

/// Blocks that claim more than their bytes unpack to: the decoder would take memory for one of any size.
fn check_blocks(bytes: &[u8]) -> Result<(), String> {
    let read = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    let most = MAX_BLOCK_BYTES.max(bytes.len() as u64 * MAX_PIXELS_A_BYTE);
    for header in &read.headers {
        let (width, height) = match header.blocks {
            BlockDescription::Tiles(tiles) => (tiles.tile_size.width(), tiles.tile_size.height()),
            BlockDescription::ScanLines => (header.layer_size.width(), header.compression.scan_lines_per_block()),
        };
        let pixels = (width as u64).saturating_mul(height as u64);
        let claimed = pixels.saturating_mul(header.channels.bytes_per_pixel as u64);
        if claimed > most {
            return Err(format!("a block of {claimed} bytes is claimed in {} bytes", bytes.len()));
        }
    }
    Ok(())
}

fn read_pixels<D: ImageDecoder>(
    decoder: ImageResult<D>,
    file_bytes: usize,
    path: &Path,
    malformed: impl Fn(image::ImageError) -> EnvironmentError,
) -> Result<Environment, EnvironmentError> {
    let decoder = decoder.map_err(&malformed)?;
    let (width_px, height_px) = decoder.dimensions();
    let pixels = u64::from(width_px) * u64::from(height_px);
    if pixels == 0 || pixels > Environment::MAX_PIXELS {
        let most = Environment::MAX_PIXELS;
        return Err(EnvironmentError::Size { path: path.to_owned(), width_px, height_px, most });
    }
    if pixels > file_bytes as u64 * MAX_PIXELS_A_BYTE {
        let reason = format!("{width_px} x {height_px} pixels are claimed in {file_bytes} bytes");
        return Err(EnvironmentError::Malformed { path: path.to_owned(), reason });
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(&malformed)?.into_rgb32f();
    let radiance = picture.pixels().map(|pixel| pixel.0.map(usable)).collect();
    Ok(Environment { width_px, height_px, radiance })
}

fn usable(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, Environment::MAX_RADIANCE) }
}
