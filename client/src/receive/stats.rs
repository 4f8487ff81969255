//! Figures about the last second, for the panel, and how they are kept.

use std::collections::VecDeque;

use serde::Serialize;

/// Rates are means over this many seconds.
const WINDOW_S: f64 = 1.0;
/// Weight of a new duration in a running mean.
const NEW_WEIGHT: f64 = 0.2;

/// The figures of the panel. Fields that cannot be known yet are `None`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Stats {
    /// Pictures drawn a second.
    pub fps: f64,
    /// Megabits a second received.
    pub mbit_per_s: f64,
    /// Bytes received in this session.
    pub bytes_received: u64,
    /// From a pose's sending to the first picture that used what it brought, in milliseconds.
    pub round_trip_ms: Option<f64>,
    /// Of a ping, in milliseconds.
    pub ping_ms: Option<f64>,
    /// Samples held.
    pub samples: u64,
    /// Images held.
    pub patches: usize,
    /// Share of the last counted picture that no sample covers: sky and holes, which a client cannot tell apart.
    pub uncovered_share: Option<f64>,
    /// Scene time now less scene time shown, in milliseconds; 0 where what is shown was made for a moment that is still to come.
    pub age_ms: Option<f64>,
    /// Seconds between the server's updates, as it announced it.
    pub update_interval_s: Option<f64>,
    /// Running means in milliseconds.
    pub ms: StageMs,
    /// The scene's name.
    pub scene: String,
    /// Pictures drawn since the start.
    pub frames: u64,
    /// Updates applied in this session.
    pub updates: u64,
}

/// Time by stage, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct StageMs {
    /// Decoding an update.
    pub decode: f64,
    /// Drawing the surfaces.
    pub surface: f64,
    /// Filling and lighting.
    pub light: f64,
}

/// A running mean that starts at its first value.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mean(Option<f64>);

impl Mean {
    /// Takes a value.
    pub fn add(&mut self, value: f64) {
        self.0 = Some(self.0.map_or(value, |mean| mean + (value - mean) * NEW_WEIGHT));
    }

    /// The mean, `None` before the first value.
    pub fn get(&self) -> Option<f64> {
        self.0
    }
}

/// A sum over the last second, as a rate.
#[derive(Debug, Clone, Default)]
pub struct Rate {
    events: VecDeque<(f64, f64)>,
    sum: f64,
    first_s: Option<f64>,
}

impl Rate {
    /// Counts `amount` at `now_s`.
    pub fn add(&mut self, amount: f64, now_s: f64) {
        self.first_s.get_or_insert(now_s);
        self.events.push_back((now_s, amount));
        self.sum += amount;
        self.forget(now_s);
    }

    /// The amount a second at `now_s`.
    pub fn per_s(&mut self, now_s: f64) -> f64 {
        self.forget(now_s);
        if self.events.is_empty() {
            return 0.0;
        }
        // In the first second the window is not yet full.
        let seen_s = self.first_s.map_or(WINDOW_S, |first_s| (now_s - first_s).clamp(WINDOW_S / 10.0, WINDOW_S));
        self.sum / seen_s
    }

    fn forget(&mut self, now_s: f64) {
        while let Some(&(at_s, amount)) = self.events.front() {
            if now_s - at_s <= WINDOW_S {
                return;
            }
            self.events.pop_front();
            self.sum -= amount;
        }
        self.sum = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_of_the_last_second() {
        let mut rate = Rate::default();
        assert_eq!(rate.per_s(0.0), 0.0);
        for frame in 0..120 {
            rate.add(1.0, f64::from(frame) / 60.0);
        }
        assert!((rate.per_s(119.0 / 60.0) - 60.0).abs() <= 1.5, "{}", rate.per_s(119.0 / 60.0));
        assert_eq!(rate.per_s(10.0), 0.0, "nothing for long is nothing");
        rate.add(5.0, 20.0);
        assert_eq!(rate.per_s(20.0), 5.0, "no rounding is left over");
    }

    #[test]
    fn a_mean_follows() {
        let mut mean = Mean::default();
        assert_eq!(mean.get(), None);
        mean.add(10.0);
        assert_eq!(mean.get(), Some(10.0));
        for _ in 0..100 {
            mean.add(20.0);
        }
        assert!((mean.get().expect("values") - 20.0).abs() < 1e-6);
    }
}
