//! The spread of a measure over frames, eyes or runs: mean, median, bad tail and worst.

use serde::{Deserialize, Serialize};

/// Which end of a measure is the good one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Better {
    /// Errors, times and bytes.
    Lower,
    /// Similarities.
    Higher,
}

/// The spread of a measure. The tail is the bad one: the 95th percentile where low is good, the 5th where high is good.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Arithmetic mean.
    pub mean: f64,
    /// Half of the values are better.
    pub median: f64,
    /// 95 of 100 values are better.
    pub p95: f64,
    /// No value is worse.
    pub worst: f64,
    /// How many values there are.
    pub count: usize,
}

impl Spread {
    /// The spread of `values`; `None` of no values. A value that is not a number makes every figure NaN, so that it shows.
    pub fn of(values: &[f64], better: Better) -> Option<Spread> {
        if values.is_empty() {
            return None;
        }
        if values.iter().any(|value| value.is_nan()) {
            return Some(Spread {
                mean: f64::NAN,
                median: f64::NAN,
                p95: f64::NAN,
                worst: f64::NAN,
                count: values.len(),
            });
        }
        let mut good_first = values.to_vec();
        good_first.sort_by(f64::total_cmp);
        if better == Better::Higher {
            good_first.reverse();
        }
        Some(Spread {
            mean: values.iter().sum::<f64>() / values.len() as f64,
            median: at_share(&good_first, 0.5),
            p95: at_share(&good_first, 0.95),
            worst: good_first[good_first.len() - 1],
            count: values.len(),
        })
    }

    /// The spread of one value.
    pub fn single(value: f64) -> Spread {
        Spread { mean: value, median: value, p95: value, worst: value, count: 1 }
    }
}

/// The value at a share of a sorted, non-empty list, interpolated linearly as numpy's `percentile` does.
fn at_share(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[position.floor() as usize], sorted[position.ceil() as usize]);
    below + (above - below) * position.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_the_bad_one() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        let error = Spread::of(&values, Better::Lower).unwrap();
        assert_eq!((error.mean, error.median, error.p95, error.worst, error.count), (50.0, 50.0, 95.0, 100.0, 101));
        let similarity = Spread::of(&values, Better::Higher).unwrap();
        assert_eq!((similarity.p95, similarity.worst), (5.0, 0.0));
    }

    #[test]
    fn percentiles_are_interpolated() {
        let spread = Spread::of(&[3.0, 1.0], Better::Lower).unwrap();
        assert!((spread.p95 - 2.9).abs() < 1e-12 && spread.median == 2.0);
    }

    #[test]
    fn nothing_and_not_a_number_do_not_look_like_figures() {
        assert_eq!(Spread::of(&[], Better::Lower), None);
        assert!(Spread::of(&[0.0, f64::NAN], Better::Lower).unwrap().mean.is_nan());
    }
}
