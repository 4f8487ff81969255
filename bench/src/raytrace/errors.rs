//! How far a drawn reflection is from the traced one.

use crate::compare::PictureError;
use crate::spread::{Better, Spread};

/// The spread of absolute errors over the pixels that either mask names, each the mean of its three channels, from 0
/// (equal) to 1 (black for white), of sRGB-encoded colours. Masks say where truth and result show the object in
/// question, so that a reflection that is drawn beside its place counts as well. `None` where neither shows it.
///
/// # Errors
/// [`PictureError::Mask`] where lengths differ from that of `truth`.
pub fn masked_errors(
    truth: &[[u8; 3]],
    result: &[[u8; 3]],
    truth_mask: &[bool],
    result_mask: &[bool],
) -> Result<Option<Spread>, PictureError> {
    let expected = truth.len();
    for found in [result.len(), truth_mask.len(), result_mask.len()] {
        if found != expected {
            return Err(PictureError::Mask { expected, found });
        }
    }
    let error = |(a, b): (&[u8; 3], &[u8; 3])| {
        let sum: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
        f64::from(sum) / (3.0 * 255.0)
    };
    let shown = truth_mask.iter().zip(result_mask).map(|(a, b)| *a || *b);
    let pairs = truth.iter().zip(result).zip(shown).filter(|(_, shown)| *shown);
    let errors: Vec<f64> = pairs.map(|(pair, _)| error(pair)).collect();
    Ok(Spread::of(&errors, Better::Lower))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_count_where_either_shows_the_object() {
        let truth = [[0; 3], [255; 3], [10, 20, 30], [9; 3]];
        let result = [[255; 3], [255; 3], [10, 20, 60], [0; 3]];
        let spread = masked_errors(&truth, &result, &[true, false, false, false], &[false, true, true, false]);
        let spread = spread.expect("of one length").expect("three pixels");
        let third = 30.0 / 765.0;
        assert_eq!(spread.count, 3);
        assert!((spread.mean - (1.0 + third) / 3.0).abs() < 1e-12);
        // Between the second and the largest of three, at 0.95 of the way from the first to the last.
        assert!((spread.p95 - (third + 0.9 * (1.0 - third))).abs() < 1e-12);
    }

    #[test]
    fn nothing_shown_is_no_error_and_lengths_must_agree() {
        assert!(masked_errors(&[[0; 3]], &[[9; 3]], &[false], &[false]).expect("of one length").is_none());
        assert!(masked_errors(&[[0; 3]], &[[9; 3]], &[true, true], &[false]).is_err());
    }
}
