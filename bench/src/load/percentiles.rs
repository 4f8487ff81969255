//! Percentiles of many values.

use serde::Serialize;

/// Of a measure in milliseconds; not numbers where nothing was measured.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Percentiles {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Worst.
    pub max: f64,
}

impl Percentiles {
    /// Of values in milliseconds.
    pub fn of(mut values_ms: Vec<f64>) -> Percentiles {
        values_ms.sort_by(f64::total_cmp);
        let count = values_ms.len();
        let at = |share: f64| match count {
            0 => f64::NAN,
            count => values_ms[((share * count as f64).ceil() as usize).clamp(1, count) - 1],
        };
        let mean = values_ms.iter().sum::<f64>() / count as f64;
        Percentiles { mean, p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_values() {
        let of = Percentiles::of((1..=100).rev().map(f64::from).collect());
        assert_eq!((of.p50, of.p99, of.max, of.mean), (50.0, 99.0, 100.0, 50.5));
        assert!(Percentiles::of(Vec::new()).p99.is_nan());
    }
}
