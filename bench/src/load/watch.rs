//! Looking on while clients run: counts once a second, and what the run costs.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use server::stats::resident_bytes;
use tokio::time::{MissedTickBehavior, interval};

use super::client::Shared;
use super::health::health;
use super::series::Counts;
use crate::report::progress::Progress;
use crate::spent::spent;

const LOOKS_EVERY: Duration = Duration::from_secs(1);
/// A last second that is shorter than this says nothing about rates.
const MIN_SECOND_S: f64 = 0.5;

/// Looks at what the clients count until the run is over; where a terminal is to be told, of a run of what duration.
pub(super) async fn look_on(shared: Arc<Shared>, told: Option<Duration>) -> Vec<Counts> {
    let progress = told.map(|duration| Progress::new("load", duration.as_secs()));
    let mut counts = vec![Counts::default()];
    let mut looks = interval(LOOKS_EVERY);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    looks.tick().await;
    loop {
        let is_over = tokio::select! {
            _ = looks.tick() => false,
            () = shared.is_over.notified() => true,
        };
        let (before, now) = (counts[counts.len() - 1], shared.counters.at(shared.now_s()));
        if !is_over || now.at_s - before.at_s >= MIN_SECOND_S {
            counts.push(now);
        }
        if is_over {
            return counts;
        }
        if let Some(progress) = &progress {
            progress.say(said(&before, &now));
            progress.step();
        }
    }
}

/// A line for a terminal: what came since the look before.
fn said(before: &Counts, now: &Counts) -> String {
    let mut text = format!("{} clients, {} updates a second", now.connected, now.updates - before.updates);
    for (name, count) in [("errors", now.errors), ("reconnections", now.reconnections)] {
        if count > 0 {
            text += &format!(", {count} {name}");
        }
    }
    text
}

/// What a run takes at a moment.
pub(super) struct Cost {
    /// What the server says of itself; null where it does not.
    pub health: Value,
    /// In RAM, of this process.
    pub load_bytes: Option<u64>,
    spent_s: Option<f64>,
    at: Instant,
}

impl Cost {
    /// Asks the server at an address, and the system about this process.
    pub async fn now(server: &str) -> Cost {
        let health = health(server).await;
        let spent_s = spent([]).map(|spent| spent.all_s);
        Cost { health, load_bytes: resident_bytes(), spent_s, at: Instant::now() }
    }

    /// In RAM, of the server.
    pub fn server_bytes(&self) -> Option<u64> {
        self.health["resident_bytes"].as_u64()
    }

    /// Processor seconds a second of this process since an earlier moment.
    pub fn cores_since(&self, earlier: &Cost) -> Option<f64> {
        let (spent_s, before_s) = self.spent_s.zip(earlier.spent_s)?;
        Some((spent_s - before_s) / self.at.duration_since(earlier.at).as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_is_told_what_went_wrong() {
        let before = Counts { updates: 10, ..Counts::default() };
        let now = Counts { connected: 5, updates: 17, ..Counts::default() };
        assert_eq!(said(&before, &now), "5 clients, 7 updates a second");
        let now = Counts { errors: 2, reconnections: 3, ..now };
        assert_eq!(said(&before, &now), "5 clients, 7 updates a second, 2 errors, 3 reconnections");
    }
}
