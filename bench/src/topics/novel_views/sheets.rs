//! Contact sheets: what was seen in the median and in the worst frame of each part of a motion.

use super::truths::Pair;
use crate::compare::flip::error_picture;
use crate::compare::folder::FrameRow;
use crate::compare::{Picture, flip_map};

/// White between the pictures of a sheet.
const GAP_PX: u32 = 4;
/// What is left of the colours outside of the band.
const FADED: f64 = 0.2;

/// The pictures of a frame on one sheet: what was shown and the truth, and below them the difference and what was shown in the outline band.
pub fn sheet(pair: &Pair, antialias: bool) -> anyhow::Result<Picture> {
    let (shown, truth) = (&pair.picture, pair.truth.of(antialias));
    let error = error_picture(&flip_map(shown, truth)?, shown.width_px, shown.height_px);
    let top = Picture::beside(&[shown, truth], GAP_PX);
    let bottom = Picture::beside(&[&error, &band_alone(shown, &pair.truth.band)], GAP_PX);
    Ok(Picture::below(&[&top, &bottom], GAP_PX))
}

/// What a sheet shows, for its caption.
pub const LAYOUT: &str = "above what was shown and the truth, below the difference (FLIP: black 0, pale yellow 1) and what was shown, \
     faded outside of the outline band";

fn band_alone(picture: &Picture, band: &[bool]) -> Picture {
    let fade = |value: u8| (255.0 - (255.0 - f64::from(value)) * FADED).round() as u8;
    let pixel = |(rgb, &in_band): (&[u8], &bool)| [0, 1, 2].map(|c| if in_band { rgb[c] } else { fade(rgb[c]) });
    let rgb = picture.rgb.chunks_exact(3).zip(band).flat_map(pixel).collect();
    Picture { rgb, covered: None, ..*picture }
}

/// Places of the median frame and of the worst one, by FLIP over covered pixels against the truth that counts; one where all are alike, as
/// at rest.
pub fn median_and_worst(scores: &[FrameRow], antialias: bool) -> Vec<(usize, &'static str)> {
    let measure = if antialias { "flip_16x_covered" } else { "flip_covered" };
    let error = |index: usize| scores[index].measure(measure).unwrap_or(0.0);
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by(|&a, &b| error(a).total_cmp(&error(b)));
    match (order.get(order.len() / 2), order.first(), order.last()) {
        (Some(_), Some(&best), Some(&worst)) if error(best) == error(worst) => vec![(worst, "every")],
        (Some(&median), _, Some(&worst)) => vec![(median, "median"), (worst, "worst")],
        _ => Vec::new(),
    }
}
