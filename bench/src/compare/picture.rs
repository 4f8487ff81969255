//! [`Picture`]: what is scored, as shown on a screen, with an optional mask of where there is a surface.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// A picture as shown: sRGB-encoded bytes, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels.
    pub width_px: u32,
    /// Pixels.
    pub height_px: u32,
    /// Three bytes a pixel.
    pub rgb: Vec<u8>,
    /// Where there is a surface, a value a pixel; `None` where the picture does not say.
    pub covered: Option<Vec<bool>>,
}

/// Why a picture could not be read or scored.
#[derive(Debug, Error)]
pub enum PictureError {
    /// Two pictures that belong together differ in size.
    #[error("the frame is {0}x{1} pixels and its truth is {2}x{3}")]
    Size(u32, u32, u32, u32),
    /// Smaller than the window of SSIM.
    #[error("a picture of {width_px}x{height_px} pixels is too small to score: 7x7 are needed")]
    Small {
        /// Pixels.
        width_px: u32,
        /// Pixels.
        height_px: u32,
    },
    /// A mask does not fit its picture.
    #[error("a mask of {found} values for {expected} pixels")]
    Mask {
        /// Pixels of the picture.
        expected: usize,
        /// Values of the mask.
        found: usize,
    },
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
}

impl Picture {
    /// One colour.
    pub fn filled(width_px: u32, height_px: u32, colour: [u8; 3]) -> Picture {
        let rgb = colour.repeat(width_px as usize * height_px as usize);
        Picture { width_px, height_px, rgb, covered: None }
    }

    /// From four bytes a pixel; alpha above 0 says that there is a surface.
    pub fn from_rgba(width_px: u32, height_px: u32, rgba: &[u8]) -> Picture {
        let rgb = rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        let covered = rgba.chunks_exact(4).map(|pixel| pixel[3] > 0).collect();
        Picture { width_px, height_px, rgb, covered: Some(covered) }
    }

    /// How many pixels there are.
    pub fn pixel_count(&self) -> usize {
        self.width_px as usize * self.height_px as usize
    }

    /// Fails where two pictures differ in size.
    pub fn same_size_as(&self, truth: &Picture) -> Result<(), PictureError> {
        if (self.width_px, self.height_px) == (truth.width_px, truth.height_px) {
            Ok(())
        } else {
            Err(PictureError::Size(self.width_px, self.height_px, truth.width_px, truth.height_px))
        }
    }

    /// Reads a PNG or JPEG. Where it has an alpha channel, that is the mask: above 0 there is a surface.
    pub fn read(path: &Path) -> Result<Picture, PictureError> {
        let file_error = |source| PictureError::File { path: path.to_owned(), source };
        let decoded = image::open(path).map_err(file_error)?;
        if decoded.color().has_alpha() {
            let rgba = decoded.into_rgba8();
            Ok(Picture::from_rgba(rgba.width(), rgba.height(), &rgba))
        } else {
            let rgb = decoded.into_rgb8();
            Ok(Picture { width_px: rgb.width(), height_px: rgb.height(), rgb: rgb.into_raw(), covered: None })
        }
    }

    /// Writes the colours as a PNG, without the mask.
    pub fn write(&self, path: &Path) -> Result<(), PictureError> {
        image::save_buffer(path, &self.rgb, self.width_px, self.height_px, image::ExtendedColorType::Rgb8)
            .map_err(|source| PictureError::File { path: path.to_owned(), source })
    }

    /// Writes the mask as a grey PNG: 255 where there is a surface.
    pub fn write_covered(&self, path: &Path) -> Result<(), PictureError> {
        let grey: Vec<u8> = match &self.covered {
            Some(covered) => covered.iter().map(|&covered| if covered { 255 } else { 0 }).collect(),
            None => vec![255; self.pixel_count()],
        };
        image::save_buffer(path, &grey, self.width_px, self.height_px, image::ExtendedColorType::L8)
            .map_err(|source| PictureError::File { path: path.to_owned(), source })
    }

    /// Reads a mask that [`Picture::write_covered`] wrote and takes it for this picture.
    pub fn read_covered(&mut self, path: &Path) -> Result<(), PictureError> {
        let file_error = |source| PictureError::File { path: path.to_owned(), source };
        let grey = image::open(path).map_err(file_error)?.into_luma8();
        if (grey.width(), grey.height()) != (self.width_px, self.height_px) {
            return Err(PictureError::Size(self.width_px, self.height_px, grey.width(), grey.height()));
        }
        self.covered = Some(grey.iter().map(|&value| value > 127).collect());
        Ok(())
    }

    /// Pictures of one height side by side, with a gap of `gap_px` in white.
    pub fn beside(pictures: &[&Picture], gap_px: u32) -> Picture {
        let height_px = pictures.iter().map(|picture| picture.height_px).max().unwrap_or(0);
        let gaps_px = gap_px * (pictures.len() as u32).saturating_sub(1);
        let width_px = pictures.iter().map(|picture| picture.width_px).sum::<u32>() + gaps_px;
        let mut sheet = Picture::filled(width_px, height_px, [255; 3]);
        let mut left_px = 0;
        for picture in pictures {
            let row_bytes = picture.width_px as usize * 3;
            for (y, row) in picture.rgb.chunks_exact(row_bytes.max(1)).enumerate() {
                let start = (y * width_px as usize + left_px as usize) * 3;
                sheet.rgb[start..start + row_bytes].copy_from_slice(row);
            }
            left_px += picture.width_px + gap_px;
        }
        sheet
    }

    /// Pictures of one width below each other, with a gap of `gap_px` in white.
    pub fn below(pictures: &[&Picture], gap_px: u32) -> Picture {
        let width_px = pictures.iter().map(|picture| picture.width_px).max().unwrap_or(0);
        let gap = vec![255; (width_px * gap_px * 3) as usize];
        let rows: Vec<&[u8]> = pictures.iter().map(|picture| picture.rgb.as_slice()).collect();
        let gaps_px = gap_px * (pictures.len() as u32).saturating_sub(1);
        let height_px = pictures.iter().map(|picture| picture.height_px).sum::<u32>() + gaps_px;
        Picture { width_px, height_px, rgb: rows.join(gap.as_slice()), covered: None }
    }

    /// A part of the picture: its columns `left_px..left_px + width_px`.
    pub fn columns(&self, left_px: u32, width_px: u32) -> Picture {
        let (left, count) =
            (left_px.min(self.width_px) as usize, width_px.min(self.width_px - left_px.min(self.width_px)));
        let row_bytes = self.width_px as usize * 3;
        let rgb = self
            .rgb
            .chunks_exact(row_bytes.max(1))
            .flat_map(|row| row[left * 3..(left + count as usize) * 3].iter().copied())
            .collect();
        Picture { width_px: count, height_px: self.height_px, rgb, covered: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beside_and_columns_are_opposites() {
        let (a, b) = (Picture::filled(5, 4, [1, 2, 3]), Picture::filled(3, 4, [9, 8, 7]));
        let sheet = Picture::beside(&[&a, &b], 2);
        assert_eq!((sheet.width_px, sheet.height_px), (10, 4));
        assert_eq!(sheet.columns(0, 5), a);
        assert_eq!(sheet.columns(7, 3), b);
        assert_eq!(sheet.columns(5, 2), Picture::filled(2, 4, [255; 3]));
    }

    #[test]
    fn below_keeps_rows_in_order() {
        let (a, b) = (Picture::filled(3, 2, [1, 2, 3]), Picture::filled(3, 1, [9, 8, 7]));
        let sheet = Picture::below(&[&a, &b], 1);
        assert_eq!((sheet.width_px, sheet.height_px, sheet.rgb.len()), (3, 4, 36));
        let rows: Vec<u8> = sheet.rgb.chunks(9).map(|row| row[0]).collect();
        assert_eq!(rows, [1, 1, 255, 9]);
    }
}
