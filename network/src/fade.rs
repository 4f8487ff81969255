//! A bandwidth that changes with time, see [`Fading`].

use crate::Fading;
use crate::random::Random;

/// So long a bandwidth stays as it is, seconds: recordings were taken by so many.
const STEP_S: f64 = 0.5;
/// No further from the median than so many times the spread: once in 370 steps it would be.
const FURTHEST: f64 = 3.0;
/// All connections of a path go through one radio, so one seed is theirs.
const SEED: u64 = 0x5eed;

/// The logarithm of a bandwidth over that of its median, which wanders (an Ornstein-Uhlenbeck process, step by step). Asked in order of time.
#[derive(Debug, Clone)]
pub(crate) struct Fade {
    fading: Fading,
    random: Random,
    step: u64,
    /// In spreads.
    deviation: f64,
}

impl Fade {
    pub fn new(fading: Fading) -> Fade {
        let mut random = Random::new(SEED);
        let deviation = random.next_normal();
        Fade { fading, random, step: 0, deviation }
    }

    /// What the bandwidth is at a time, over its median, and until when. An earlier time counts as the latest one before it.
    pub fn at(&mut self, at_s: f64) -> (f64, f64) {
        let step = (at_s.max(0.0) / STEP_S) as u64;
        let keeps = (-STEP_S / self.fading.forgets_s).exp();
        while self.step < step {
            self.step += 1;
            self.deviation = keeps * self.deviation + (1.0 - keeps * keeps).sqrt() * self.random.next_normal();
        }
        let factor = (self.fading.spread * self.deviation.clamp(-FURTHEST, FURTHEST)).exp();
        (factor, (self.step + 1) as f64 * STEP_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_wanders_about_its_median_as_far_and_as_slowly_as_asked() {
        let mut fade = Fade::new(Fading { spread: 1.2, forgets_s: 5.0 });
        let logs: Vec<f64> = (0..40_000).map(|step| fade.at(f64::from(step) * STEP_S).0.ln()).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let spread = (logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt();
        let together: f64 = logs.windows(11).map(|window| (window[0] - mean) * (window[10] - mean)).sum();
        let alike = together / (logs.len() - 10) as f64 / spread.powi(2);
        // Four standard errors of 4,000 independent values.
        assert!(mean.abs() < 0.08 && (spread - 1.2).abs() < 0.06, "{mean} {spread}");
        assert!((alike - (-1.0_f64).exp()).abs() < 0.06, "{alike} after five seconds");
    }

    #[test]
    fn one_time_has_one_bandwidth() {
        let fading = Fading { spread: 1.0, forgets_s: 2.0 };
        let (mut every, mut seldom) = (Fade::new(fading), Fade::new(fading));
        let last = (0..100).map(|step| every.at(f64::from(step) * 0.1)).last().expect("a hundred");
        assert_eq!(last, seldom.at(9.9));
        assert_eq!(seldom.at(3.0), last, "an earlier time counts as the latest");
        assert_eq!(last.1, 10.0);
    }
}
