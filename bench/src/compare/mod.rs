//! Scores of a picture against the truth.
//!
//! | score | meaning | good |
//! |---|---|---|
//! | `flip` | mean FLIP error (Andersson et al. 2020), LDR, 67 pixels a degree | 0 |
//! | `flip_covered` | the same over the pixels where the truth has a surface | 0 |
//! | `flip_band` | the same over the outline band of the truth ([`band`]) | 0 |
//! | `flip_16x`, `flip_16x_covered`, `flip_16x_band` | FLIP against the truth with 16 samples a pixel, where there is one | 0 |
//! | `ssim` | structural similarity (Wang et al. 2004), 7x7 uniform window, RGB mean | 1 |
//! | `psnr_db` | peak signal to noise over RGB, at most 100 dB | 100 |
//! | `flicker` | mean absolute difference between the picture's and the truth's change since the last frame, 0-255 | 0 |
//! | `holes_share` | share of covered pixels that the picture marks as uncovered | 0 |
//! | `false_cover_share` | pixels that the picture covers and the truth does not, as a share of the covered ones | 0 |
//!
//! Pictures are sRGB-encoded bytes, as shown. [`score`] takes two of them; [`folder`] scores a run of frames.

pub mod band;
pub mod flip;
pub mod folder;
pub mod picture;
pub mod ssim;

use serde::Serialize;

use crate::spread::Better;
pub use flip::flip_map;
pub use picture::{Picture, PictureError};
pub use ssim::ssim;

/// The most that [`psnr_db`] gives: that of equal pictures.
pub const PSNR_CAP_DB: f64 = 100.0;

/// What one frame is worth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scores {
    /// Mean FLIP error over all pixels.
    pub flip: f64,
    /// Mean FLIP error over covered pixels; `None` where nothing is covered.
    pub flip_covered: Option<f64>,
    /// Mean FLIP error over the outline band; `None` where no band was given, or it is empty.
    pub flip_band: Option<f64>,
    /// Structural similarity.
    pub ssim: f64,
    /// Peak signal to noise, at most [`PSNR_CAP_DB`].
    pub psnr_db: f64,
    /// Share of covered pixels that the frame marks as uncovered; `None` where it marks nothing.
    pub holes_share: Option<f64>,
    /// Pixels that the frame covers and the truth does not, as a share of the covered ones; `None` where the frame marks nothing.
    pub false_cover_share: Option<f64>,
    /// Share of all pixels where the truth has a surface.
    pub covered_share: f64,
}

/// The measures of a frame by name, with their good end; the columns of every table of pictures.
pub const MEASURES: [(&str, Better); 13] = [
    ("flip", Better::Lower),
    ("flip_covered", Better::Lower),
    ("flip_band", Better::Lower),
    ("flip_16x", Better::Lower),
    ("flip_16x_covered", Better::Lower),
    ("flip_16x_band", Better::Lower),
    ("ssim", Better::Higher),
    ("psnr_db", Better::Higher),
    ("flicker", Better::Lower),
    ("holes_share", Better::Lower),
    ("false_cover_share", Better::Lower),
    ("uncovered_share", Better::Lower),
    ("covered_share", Better::Higher),
];

/// Which pixels of a truth count for what; a value a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub struct Regions<'a> {
    /// Where the truth has a surface; without it the truth's own mask counts, and without that every pixel is covered.
    pub covered: Option<&'a [bool]>,
    /// The outline band.
    pub band: Option<&'a [bool]>,
}

/// Scores `frame` against `truth`. `covered` is that of [`Regions`].
pub fn score(frame: &Picture, truth: &Picture, covered: Option<&[bool]>) -> Result<Scores, PictureError> {
    score_regions(frame, truth, Regions { covered, band: None })
}

/// The same with regions of one's own.
pub fn score_regions(frame: &Picture, truth: &Picture, regions: Regions<'_>) -> Result<Scores, PictureError> {
    frame.same_size_as(truth)?;
    let pixel_count = truth.pixel_count();
    let covered = regions.covered.or(truth.covered.as_deref());
    for mask in [covered, regions.band].into_iter().flatten() {
        if mask.len() != pixel_count {
            return Err(PictureError::Mask { expected: pixel_count, found: mask.len() });
        }
    }
    let is_covered = |index: usize| covered.is_none_or(|covered| covered[index]);
    let covered_count = (0..pixel_count).filter(|&index| is_covered(index)).count();
    let share_where = |wanted: &dyn Fn(usize, &[bool]) -> bool| {
        let drawn = frame.covered.as_ref().filter(|_| covered_count > 0)?;
        Some((0..pixel_count).filter(|&index| wanted(index, drawn)).count() as f64 / covered_count as f64)
    };
    let flip = flip_means(frame, truth, covered, regions.band)?;
    Ok(Scores {
        flip: flip.all,
        flip_covered: flip.covered,
        flip_band: flip.band,
        ssim: ssim(frame, truth)?,
        psnr_db: psnr_db(frame, truth)?,
        holes_share: share_where(&|index, drawn| is_covered(index) && !drawn[index]),
        false_cover_share: share_where(&|index, drawn| !is_covered(index) && drawn[index]),
        covered_share: covered_count as f64 / pixel_count.max(1) as f64,
    })
}

/// Mean FLIP errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FlipMeans {
    /// Over all pixels.
    pub all: f64,
    /// Over the covered ones; `None` where there are none.
    pub covered: Option<f64>,
    /// Over the outline band; `None` where there is none.
    pub band: Option<f64>,
}

/// Mean FLIP errors over regions; without a mask every pixel is covered, and none in the band.
pub fn flip_means(
    frame: &Picture,
    truth: &Picture,
    covered: Option<&[bool]>,
    band: Option<&[bool]>,
) -> Result<FlipMeans, PictureError> {
    let errors = flip_map(frame, truth)?;
    let mean_where = |wanted: &dyn Fn(usize) -> bool| {
        let wanted = errors.iter().enumerate().filter(|(index, _)| wanted(*index));
        let (sum, count) = wanted.fold((0.0, 0), |(sum, count), (_, &error)| (sum + f64::from(error), count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    Ok(FlipMeans {
        all: mean_where(&|_| true).unwrap_or(0.0),
        covered: mean_where(&|index| covered.is_none_or(|covered| covered[index])),
        band: mean_where(&|index| band.is_some_and(|band| band[index])),
    })
}

/// Peak signal to noise over all pixels and the three colours, at most [`PSNR_CAP_DB`].
pub fn psnr_db(frame: &Picture, truth: &Picture) -> Result<f64, PictureError> {
    frame.same_size_as(truth)?;
    let squares: u64 = frame.rgb.iter().zip(&truth.rgb).map(|(&a, &b)| u64::from(a.abs_diff(b)).pow(2)).sum();
    let mean_square = squares as f64 / (frame.rgb.len().max(1) as f64 * 255.0 * 255.0);
    Ok((-10.0 * mean_square.log10()).min(PSNR_CAP_DB))
}

/// Mean absolute difference between the frame-to-frame change of the pictures and that of the truth, 0-255.
/// `frames` and `truths` are (previous, this).
pub fn flicker(frames: (&Picture, &Picture), truths: (&Picture, &Picture)) -> Result<f64, PictureError> {
    frames.0.same_size_as(frames.1)?;
    frames.1.same_size_as(truths.0)?;
    truths.0.same_size_as(truths.1)?;
    let change = |(before, now): (&Picture, &Picture), i: usize| i32::from(now.rgb[i]) - i32::from(before.rgb[i]);
    let sum: u64 = (0..frames.0.rgb.len()).map(|i| u64::from(change(frames, i).abs_diff(change(truths, i)))).sum();
    Ok(sum as f64 / frames.0.rgb.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: u8) -> Picture {
        Picture::filled(16, 8, [value; 3])
    }

    #[test]
    fn equal_pictures_are_perfect() {
        let scores = score(&grey(90), &grey(90), None).unwrap();
        assert_eq!((scores.flip, scores.flip_covered), (0.0, Some(0.0)));
        assert_eq!((scores.ssim, scores.psnr_db), (1.0, PSNR_CAP_DB));
        assert_eq!((scores.covered_share, scores.holes_share), (1.0, None));
    }

    #[test]
    fn psnr_of_a_known_step() {
        assert!((psnr_db(&grey(100), &grey(110)).unwrap() - 20.0 * (25.5_f64).log10()).abs() < 1e-9);
        assert!(psnr_db(&grey(0), &grey(255)).unwrap().abs() < 1e-9);
    }

    #[test]
    fn black_for_white_is_the_largest_flip() {
        let worst = score(&grey(0), &grey(255), None).unwrap();
        assert!(worst.flip > 0.95 && worst.flip <= 1.0, "{}", worst.flip);
    }

    #[test]
    fn errors_outside_of_the_covered_pixels_do_not_count_as_covered() {
        let truth = grey(128);
        let mut frame = truth.clone();
        for pixel in 0..4 {
            frame.rgb[pixel * 3..pixel * 3 + 3].copy_from_slice(&[255, 0, 0]);
        }
        let covered: Vec<bool> = (0..truth.pixel_count()).map(|index| index % 16 >= 12).collect();
        let scores = score(&frame, &truth, Some(&covered)).unwrap();
        assert!(scores.flip_covered.unwrap() < scores.flip / 2.0, "{scores:?}");
        assert_eq!(scores.covered_share, 0.25);
        assert!(score(&frame, &truth, Some(&covered[1..])).is_err());
    }

    #[test]
    fn holes_are_a_share_of_covered_pixels() {
        let (mut frame, mut truth) = (grey(10), grey(10));
        truth.covered = Some((0..128).map(|index| index < 64).collect());
        frame.covered = Some((0..128).map(|index| index >= 16).collect());
        assert_eq!(score(&frame, &truth, None).unwrap().holes_share, Some(0.25));
    }

    #[test]
    fn flicker_is_the_difference_of_changes() {
        let change = |from, to| (grey(from), grey(to));
        let (frames, truths) = (change(10, 30), change(50, 60));
        assert_eq!(flicker((&frames.0, &frames.1), (&truths.0, &truths.1)).unwrap(), 10.0);
        assert_eq!(flicker((&frames.0, &frames.1), (&frames.0, &frames.1)).unwrap(), 0.0);
    }

    #[test]
    fn pictures_of_different_size_are_refused() {
        assert!(score(&grey(0), &Picture::filled(8, 16, [0; 3]), None).is_err());
    }
}
