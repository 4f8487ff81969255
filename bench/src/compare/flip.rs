//! FLIP: the error that a person sees when flipping between two pictures (Andersson et al., FLIP: A Difference Evaluator for
//! Alternating Images, 2020), by NVIDIA's own implementation at its defaults.

use super::{Picture, PictureError};

/// The error of each pixel, 0 to 1, row-major from the top.
pub fn flip_map(frame: &Picture, truth: &Picture) -> Result<Vec<f32>, PictureError> {
    frame.same_size_as(truth)?;
    if truth.pixel_count() == 0 {
        return Ok(Vec::new());
    }
    let image =
        |picture: &Picture| nv_flip::FlipImageRgb8::with_data(picture.width_px, picture.height_px, &picture.rgb);
    Ok(nv_flip::flip(image(truth), image(frame), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec())
}

/// A picture of an error map: black where 0, through purple and orange to pale yellow where 1 (the magma map).
pub fn error_picture(errors: &[f32], width_px: u32, height_px: u32) -> Picture {
    let map = nv_flip::FlipImageFloat::with_data(width_px, height_px, errors);
    let rgb = map.apply_color_lut(&nv_flip::magma_lut()).to_vec();
    Picture { width_px, height_px, rgb, covered: None }
}
