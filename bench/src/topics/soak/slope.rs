//! How fast something grows, and how surely.

/// A line through points, by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope {
    /// Growth by one of x.
    pub per_x: f64,
    /// Of that, with residuals that go with those before them taken into account.
    pub standard_error: f64,
    /// How residuals go with those before them: 0 where they do not, 1 where each is the last one over again.
    pub correlation: f64,
}

/// Residuals that are nearly the last ones over again would make a standard error of any size.
const MOST_CORRELATION: f64 = 0.99;

impl Slope {
    /// `None` of fewer than three points, or where all have one x.
    pub fn of(points: &[(f64, f64)]) -> Option<Slope> {
        let count = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (mean_x, mean_y) = (mean(|point| point.0), mean(|point| point.1));
        let spread: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
        if points.len() < 3 || spread <= 0.0 {
            return None;
        }
        let per_x = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>() / spread;
        let residuals: Vec<f64> = points.iter().map(|(x, y)| y - mean_y - per_x * (x - mean_x)).collect();
        let squares: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let products: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let correlation = if squares > 0.0 { (products / squares).clamp(0.0, MOST_CORRELATION) } else { 0.0 };
        let independent = (squares / (count - 2.0) / spread).sqrt();
        let standard_error = independent * ((1.0 + correlation) / (1.0 - correlation)).sqrt();
        Some(Slope { per_x, standard_error, correlation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// A walk that is drawn back to 0, and grows by so much a step.
    fn walk(rng: &mut Rng, steps: usize, pull: f64, growth: f64) -> Vec<(f64, f64)> {
        let mut at = 0.0;
        let step = |index| {
            at = at * (1.0 - pull) + rng.range(-1.0, 1.0);
            (index as f64, at + growth * index as f64)
        };
        (0..steps).map(step).collect()
    }

    #[test]
    fn a_line_is_found_exactly() {
        let points: Vec<(f64, f64)> = (0..10).map(|x| (f64::from(x), 3.0 * f64::from(x) + 7.0)).collect();
        let slope = Slope::of(&points).expect("a line");
        assert!((slope.per_x - 3.0).abs() < 1e-12 && slope.standard_error < 1e-9, "{slope:?}");
        assert_eq!(Slope::of(&points[..2]), None);
        assert_eq!(Slope::of(&[(1.0, 2.0); 5]), None);
    }

    #[test]
    fn two_standard_errors_hold_the_truth_in_about_95_of_100_runs_of_what_moves_slowly() {
        let mut rng = Rng::new(7);
        let held = |pull: f64, rng: &mut Rng| {
            let within = |_: &usize| {
                let slope = Slope::of(&walk(rng, 400, pull, 0.01)).expect("a slope");
                (slope.per_x - 0.01).abs() <= 2.0 * slope.standard_error
            };
            (0..400).filter(within).count() as f64 / 400.0
        };
        for pull in [1.0, 0.2] {
            let held = held(pull, &mut rng);
            assert!(held > 0.9, "{held} with a pull of {pull}");
        }
    }
}
