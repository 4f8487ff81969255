//! How a client's samples are coded: what the server is told, and what the path to the client takes.

use protocol::codec::{Coding, ColourSteps, Profile};

/// A path of less than this is worth the dense profile. It saves 0.08 of zstd-1's bytes, which are 0.19 (a street) to 0.64 (a nest of
/// twigs) of the raw ones, and takes 0.17 to 0.43 µs longer a raw byte at both ends together (`vantage-report timing` and `codec`):
/// the saved bytes take longer than that from 90 to 120 kB/s down.
const DENSE_BELOW_BYTES_PER_S: f64 = 100e3;

/// Chooses the coding of each update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CodingRule {
    /// Always this; `None`: what gets an update to its viewer sooner.
    pub profile: Option<Profile>,
    /// How exactly colours are kept. In fine steps an update has a fifth fewer bytes, but where an object has one colour all of it is off
    /// alike, which shows: FLIP over a car park rises from 0.054 to 0.082.
    pub colour: ColourSteps,
}

impl CodingRule {
    /// For a client to which the path takes so many bytes a second; `None` while nothing is known of it.
    pub fn coding(&self, bytes_per_s: Option<f64>) -> Coding {
        let is_slow = bytes_per_s.is_some_and(|rate| rate < DENSE_BELOW_BYTES_PER_S);
        let sooner = if is_slow { Profile::Dense } else { Profile::Fast };
        Coding { profile: self.profile.unwrap_or(sooner), colour: self.colour }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_path_is_worth_dense_coding_and_an_order_is_an_order() {
        let profile = |rule: CodingRule, rate| rule.coding(rate).profile;
        let measured = CodingRule::default();
        assert_eq!(profile(measured, None), Profile::Fast, "the first picture should come soon");
        assert_eq!(profile(measured, Some(50e3)), Profile::Dense, "0.4 Mbit/s");
        assert_eq!(profile(measured, Some(625e3)), Profile::Fast, "5 Mbit/s");
        for profile in [Profile::Fast, Profile::Dense] {
            let rule = CodingRule { profile: Some(profile), ..measured };
            assert!([None, Some(1.0), Some(1e9)].iter().all(|&rate| rule.coding(rate).profile == profile));
        }
    }
}
