//! How far our picture of a model is from three.js's.

use std::path::Path;

use anyhow::{Context, bail};

use super::pairs::Pair;
use crate::compare::flip::error_picture;
use crate::compare::{Picture, flip_map};

/// A picture differs from its background where a byte does by more: one step is rounding.
const BACKGROUND_STEPS: u8 = 1;
/// White between the pictures of a sheet.
const GAP_PX: u32 = 4;

/// A pair with its scores.
pub(super) struct Scored {
    pub name: String,
    /// Mean FLIP over covered pixels.
    pub flip_covered: f64,
    /// The same, of our picture and of three.js's, against three.js's of 16 shaded samples a pixel.
    pub ours_to_fine: f64,
    pub three_to_fine: f64,
    /// Of all pixels.
    pub covered_share: f64,
    pub silhouettes: Silhouettes,
    /// three.js, the same finely, ours, FLIP of ours to the first.
    pub sheet: Picture,
}

impl Scored {
    /// Scores the pictures of a pair, which lie below `folder`.
    pub fn of(pair: &Pair, folder: &Path) -> anyhow::Result<Scored> {
        if let Some(why) = &pair.failed {
            bail!("{why}");
        }
        let background = pair.background.context("a pair without background")?;
        let read = |file: &str| Picture::read(&folder.join(&pair.name).join(file));
        let (mut three, fine, ours) = (read("three.png")?, read("fine.png")?, read("ours.png")?);
        three.read_covered(&folder.join(&pair.name).join("covered.png"))?;
        Scored::of_pictures(&pair.name, &three, &fine, &ours, background)
    }

    fn of_pictures(
        name: &str,
        three: &Picture,
        fine: &Picture,
        ours: &Picture,
        background: [u8; 3],
    ) -> anyhow::Result<Scored> {
        let errors = flip_map(ours, three)?;
        let covered = three.covered.as_deref().context("three.js's picture says where it shows something")?;
        if !covered.contains(&true) {
            bail!("three.js shows nothing");
        }
        let error = error_picture(&errors, three.width_px, three.height_px);
        Ok(Scored {
            name: name.to_owned(),
            flip_covered: mean_there(&errors, covered),
            ours_to_fine: mean_there(&flip_map(ours, fine)?, covered),
            three_to_fine: mean_there(&flip_map(three, fine)?, covered),
            covered_share: covered.iter().filter(|covered| **covered).count() as f64 / covered.len() as f64,
            silhouettes: Silhouettes::of(covered, &differs(ours, background), three.width_px as usize),
            sheet: Picture::beside(&[three, fine, ours, &error], GAP_PX),
        })
    }
}

/// Mean of errors where a mask is set, which is somewhere.
fn mean_there(errors: &[f32], mask: &[bool]) -> f64 {
    let there = errors.iter().zip(mask).filter(|(_, there)| **there);
    let (sum, count) = there.fold((0.0, 0), |(sum, count), (&error, _)| (sum + f64::from(error), count + 1));
    sum / f64::from(count)
}

/// How well two silhouettes agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Silhouettes {
    /// Pixels of both, as a share of the pixels of either.
    pub iou: f64,
    /// Pixels of one with none of the other in the 3 x 3 around them, as a share of three.js's.
    pub off_share: f64,
}

impl Silhouettes {
    fn of(three: &[bool], ours: &[bool], width_px: usize) -> Silhouettes {
        let both = three.iter().zip(ours).filter(|(a, b)| **a && **b).count();
        let either = three.iter().zip(ours).filter(|(a, b)| **a || **b).count();
        let alone = |mask: &[bool], other: &[bool]| {
            (0..mask.len()).filter(|&index| mask[index] && !any_around(other, width_px, index)).count()
        };
        let off = alone(three, ours) + alone(ours, three);
        let three_count = three.iter().filter(|covered| **covered).count();
        Silhouettes { iou: both as f64 / either.max(1) as f64, off_share: off as f64 / three_count.max(1) as f64 }
    }
}

/// Whether a mask holds one of the 3 x 3 pixels around a pixel.
fn any_around(mask: &[bool], width_px: usize, index: usize) -> bool {
    let (x, y) = (index % width_px, index / width_px);
    let last_row = mask.len() / width_px - 1;
    (y.saturating_sub(1)..=(y + 1).min(last_row))
        .any(|y| (x.saturating_sub(1)..=(x + 1).min(width_px - 1)).any(|x| mask[y * width_px + x]))
}

fn differs(picture: &Picture, background: [u8; 3]) -> Vec<bool> {
    let far = |pixel: &[u8]| pixel.iter().zip(background).any(|(&a, b)| a.abs_diff(b) > BACKGROUND_STEPS);
    picture.rgb.chunks_exact(3).map(far).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BACKGROUND: [u8; 3] = [28, 32, 40];

    /// A square of 24 pixels in a picture of 64, this far from the left.
    fn square(left_px: usize, colour: [u8; 3]) -> Picture {
        let mut picture = Picture::filled(64, 64, BACKGROUND);
        let inside = |index: usize| (left_px..left_px + 24).contains(&(index % 64)) && (20..44).contains(&(index / 64));
        for index in (0..64 * 64).filter(|&index| inside(index)) {
            picture.rgb[index * 3..index * 3 + 3].copy_from_slice(&colour);
        }
        picture.covered = Some((0..64 * 64).map(inside).collect());
        picture
    }

    #[test]
    fn a_picture_beside_itself_is_perfect() {
        let three = square(20, [200, 40, 40]);
        let scored = Scored::of_pictures("square", &three, &three, &three, BACKGROUND).unwrap();
        assert_eq!((scored.flip_covered, scored.ours_to_fine, scored.three_to_fine), (0.0, 0.0, 0.0));
        assert_eq!(scored.silhouettes, Silhouettes { iou: 1.0, off_share: 0.0 });
        assert_eq!(scored.covered_share, 24.0 * 24.0 / 4096.0);
        assert_eq!((scored.sheet.width_px, scored.sheet.height_px), (4 * 64 + 3 * GAP_PX, 64));
    }

    #[test]
    fn another_colour_is_an_error_and_no_other_silhouette() {
        let three = square(20, [200, 40, 40]);
        let scored = Scored::of_pictures("square", &three, &three, &square(20, [40, 200, 40]), BACKGROUND).unwrap();
        assert!(scored.flip_covered > 0.3, "{}", scored.flip_covered);
        assert_eq!((scored.ours_to_fine, scored.three_to_fine), (scored.flip_covered, 0.0));
        assert_eq!(scored.silhouettes.iou, 1.0);
    }

    #[test]
    fn a_camera_that_is_off_is_seen_by_the_silhouettes() {
        let three = square(20, [200, 40, 40]);
        let silhouettes = |left_px: usize| {
            let ours = square(left_px, [200, 40, 40]);
            Scored::of_pictures("square", &three, &three, &ours, BACKGROUND).unwrap().silhouettes
        };
        let (by_one, by_three) = (silhouettes(21), silhouettes(23));
        assert!(by_one.iou < 0.98 && by_one.off_share == 0.0, "{by_one:?}");
        // Two columns of 24 at either side.
        assert!((by_three.off_share - 4.0 / 24.0).abs() < 1e-12, "{by_three:?}");
    }

    #[test]
    fn nothing_to_compare_is_an_error() {
        let mut three = square(20, [200, 40, 40]);
        three.covered = Some(vec![false; 64 * 64]);
        assert!(Scored::of_pictures("square", &three, &three, &three, BACKGROUND).is_err());
        let failed = Pair { name: "x".into(), background: None, failed: Some("no such file".into()) };
        assert_eq!(Scored::of(&failed, Path::new("nowhere")).err().unwrap().to_string(), "no such file");
    }
}
