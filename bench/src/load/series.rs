//! What happened when: counts that all clients share, looked at once a second, and what came of each second.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::percentiles::Percentiles;

/// A measure in milliseconds, and when it was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timed {
    /// Second of the run, on the wall clock.
    pub at_s: f64,
    /// What was measured.
    pub ms: f64,
}

/// The values alone.
pub fn values_ms(timed: &[Timed]) -> impl Iterator<Item = f64> + '_ {
    timed.iter().map(|timed| timed.ms)
}

/// What all clients together count.
#[derive(Debug, Default)]
pub(super) struct Counters {
    connected: AtomicU64,
    pub updates: AtomicU64,
    pub bytes: AtomicU64,
    pub errors: AtomicU64,
    pub reconnections: AtomicU64,
}

/// A connection that is counted; dropping it ends that.
pub(super) struct Connected(Arc<Counters>);

impl Connected {
    pub fn count(counters: &Arc<Counters>) -> Connected {
        counters.connected.fetch_add(1, Ordering::Relaxed);
        Connected(counters.clone())
    }
}

impl Drop for Connected {
    fn drop(&mut self) {
        self.0.connected.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What [`Counters`] said at a time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    pub at_s: f64,
    pub connected: u64,
    pub updates: u64,
    pub bytes: u64,
    pub errors: u64,
    pub reconnections: u64,
}

impl Counters {
    pub fn at(&self, at_s: f64) -> Counts {
        let value = |of: &AtomicU64| of.load(Ordering::Relaxed);
        Counts {
            at_s,
            connected: value(&self.connected),
            updates: value(&self.updates),
            bytes: value(&self.bytes),
            errors: value(&self.errors),
            reconnections: value(&self.reconnections),
        }
    }
}

/// One second of a run.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Second {
    /// Its end, in seconds of the run.
    pub to_s: f64,
    /// Clients connected then.
    pub connected: u64,
    /// Updates of all clients.
    pub updates_per_s: f64,
    /// Bytes received by all clients.
    pub bytes_per_s: f64,
    /// Clients that ended by an error in it.
    pub errors: u64,
    /// Clients that came back in it.
    pub reconnections: u64,
    /// From a pose to the update that answers it.
    pub latency_ms: Percentiles,
    /// Between two updates of a client.
    pub interval_ms: Percentiles,
}

/// Looks at counts, a second apart or so, as the seconds between them; each with what was measured in it.
pub(super) fn seconds(counts: &[Counts], mut latencies: Vec<Timed>, mut intervals: Vec<Timed>) -> Vec<Second> {
    latencies.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    intervals.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    let within = |timed: &[Timed], from_s: f64, to_s: f64| {
        let place = |at_s: f64| timed.partition_point(|timed| timed.at_s < at_s);
        Percentiles::of(values_ms(&timed[place(from_s)..place(to_s)]).collect())
    };
    let second = |pair: &[Counts]| {
        let (from, to) = (pair[0], pair[1]);
        let rate = |before: u64, after: u64| (after - before) as f64 / (to.at_s - from.at_s);
        Second {
            to_s: to.at_s,
            connected: to.connected,
            updates_per_s: rate(from.updates, to.updates),
            bytes_per_s: rate(from.bytes, to.bytes),
            errors: to.errors - from.errors,
            reconnections: to.reconnections - from.reconnections,
            latency_ms: within(&latencies, from.at_s, to.at_s),
            interval_ms: within(&intervals, from.at_s, to.at_s),
        }
    };
    counts.windows(2).map(second).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_second_has_its_own_figures() {
        let counters = Arc::new(Counters::default());
        let begin = counters.at(0.0);
        let (first, second) = (Connected::count(&counters), Connected::count(&counters));
        counters.updates.fetch_add(10, Ordering::Relaxed);
        counters.bytes.fetch_add(4000, Ordering::Relaxed);
        let middle = counters.at(2.0);
        drop(second);
        counters.errors.fetch_add(1, Ordering::Relaxed);
        counters.reconnections.fetch_add(2, Ordering::Relaxed);
        let end = counters.at(3.0);
        drop(first);
        // Not in the order of time, as clients tell them one after the other.
        let latencies = [(2.5, 7.0), (1.9, 30.0), (0.0, 10.0), (2.0, 5.0), (3.0, 99.0)];
        let latencies = latencies.map(|(at_s, ms)| Timed { at_s, ms }).to_vec();
        let found = seconds(&[begin, middle, end], latencies, Vec::new());
        let rates: Vec<_> =
            found.iter().map(|second| (second.to_s, second.updates_per_s, second.bytes_per_s)).collect();
        assert_eq!(rates, [(2.0, 5.0, 2000.0), (3.0, 0.0, 0.0)]);
        let counts: Vec<_> =
            found.iter().map(|second| (second.connected, second.errors, second.reconnections)).collect();
        assert_eq!(counts, [(2, 0, 0), (1, 1, 2)]);
        let worst: Vec<_> = found.iter().map(|second| (second.latency_ms.p50, second.latency_ms.max)).collect();
        assert_eq!(worst, [(10.0, 30.0), (5.0, 7.0)]);
        assert!(found[0].interval_ms.p99.is_nan(), "nothing was measured");
        assert!(seconds(&[begin], Vec::new(), Vec::new()).is_empty());
        assert_eq!(counters.at(4.0).connected, 0);
    }
}
