//! What a running server counts. Shared by all sessions; read by `/healthz` and tests.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use crate::account::LightCounts;
use crate::fault::Fault;
use crate::look_times::LookTimes;
use crate::plan::Reason;
use crate::pool::Pool;

/// Counters since the server started.
#[derive(Debug, Default)]
pub struct Stats {
    /// Sessions now.
    pub clients: AtomicUsize,
    /// Sessions ever.
    pub connected: AtomicU64,
    /// Sessions that the server ended: misbehaviour and slow reading.
    pub cut_off: AtomicU64,
    /// Sessions that went on after their connection was cut off.
    pub resumed: AtomicU64,
    /// Faults of the server, each of which ended a session at most.
    pub faults: AtomicU64,
    /// How often what draws was made anew after a fault or a lost GPU.
    pub renewals: AtomicU64,
    /// Updates handed to sessions.
    pub updates: AtomicU64,
    /// Bytes handed to sockets.
    pub sent_bytes: AtomicU64,
    /// What lights took.
    pub lights: LightStats,
    /// What was sent for later.
    pub ahead: AheadStats,
    /// Where the time of looks goes.
    pub look_times: LookTimes,
    /// Times that a scene was to be loaded anew.
    pub reloads: AtomicU64,
    /// Whether that failed the last time.
    pub reload_failed: AtomicBool,
    /// What went to a broker.
    pub published: Published,
    /// Scenes that were loaded as they were asked for.
    pub scenes: SceneStats,
    looks: [AtomicU64; Reason::ALL.len()],
}

/// Scenes that were loaded as they were asked for, see [`crate::serving`].
#[derive(Debug, Default)]
pub struct SceneStats {
    /// Times that one was opened.
    pub opened: AtomicU64,
    /// Times that one was put away.
    pub put_away: AtomicU64,
    /// Times that one could not be loaded.
    pub failed: AtomicU64,
}

/// What went to a broker, see [`crate::publish`].
#[derive(Debug, Default)]
pub struct Published {
    /// Updates.
    pub updates: AtomicU64,
    /// Whole copies.
    pub wholes: AtomicU64,
    /// Bytes of messages.
    pub bytes: AtomicU64,
}

impl Stats {
    /// Counts a fault, and logs it.
    pub fn count_fault(&self, fault: &Fault) {
        self.faults.fetch_add(1, Ordering::Relaxed);
        tracing::error!("{fault}");
    }

    /// Counts an update.
    pub fn count_look(&self, reason: Reason) {
        self.looks[reason as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Updates made for a reason.
    pub fn looks(&self, reason: Reason) -> u64 {
        self.looks[reason as usize].load(Ordering::Relaxed)
    }

    /// As JSON, for `/healthz`, with what was drawn of the scene.
    pub fn json(&self, pool: &Pool) -> serde_json::Value {
        let looks: serde_json::Map<_, _> =
            Reason::ALL.iter().map(|&reason| (reason.name().to_owned(), self.looks(reason).into())).collect();
        serde_json::json!({
            "clients": self.clients.load(Ordering::Relaxed),
            "connected": self.connected.load(Ordering::Relaxed),
            "resumed": self.resumed.load(Ordering::Relaxed),
            "cut_off": self.cut_off.load(Ordering::Relaxed),
            "faults": self.faults.load(Ordering::Relaxed),
            "renewals": self.renewals.load(Ordering::Relaxed),
            "updates": self.updates.load(Ordering::Relaxed),
            "sent_bytes": self.sent_bytes.load(Ordering::Relaxed),
            "looks": looks,
            "look_times": self.look_times.json(),
            "pool": pool.json(),
            "lights": self.lights.json(),
            "ahead": { "samples": self.ahead.samples.load(Ordering::Relaxed), "bytes": self.ahead.bytes.load(Ordering::Relaxed) },
            "resident_bytes": resident_bytes(),
        })
    }
}

/// What was sent before anybody needed it, see [`crate::anticipate`].
#[derive(Debug, Default)]
pub struct AheadStats {
    /// Samples.
    pub samples: AtomicU64,
    /// Bytes of updates.
    pub bytes: AtomicU64,
}

impl AheadStats {
    /// Counts an update.
    pub fn count(&self, samples: usize, bytes: usize) {
        self.samples.fetch_add(samples as u64, Ordering::Relaxed);
        self.bytes.fetch_add(bytes as u64, Ordering::Relaxed);
    }
}

/// What images of lights took, and what was saved where nothing moved.
#[derive(Debug, Default)]
pub struct LightStats {
    /// Bytes of updates that are for lights.
    pub bytes: AtomicU64,
    /// Wall time for them, in microseconds.
    pub took_us: AtomicU64,
    /// Updates that left a light's set as it was.
    pub unchanged: AtomicU64,
    /// Updates in which a light cast nothing.
    pub without: AtomicU64,
    /// Sets that were begun, and bytes and time of the updates that did.
    sets: AtomicU64,
    set_bytes: AtomicU64,
    set_us: AtomicU64,
}

impl LightStats {
    /// Counts an update's part for lights.
    pub fn count(&self, counts: &LightCounts, bytes: usize, took: Duration) {
        let add = |to: &AtomicU64, value: u64| {
            to.fetch_add(value, Ordering::Relaxed);
        };
        let took_us = u64::try_from(took.as_micros()).unwrap_or(u64::MAX);
        add(&self.bytes, bytes as u64);
        add(&self.took_us, took_us);
        add(&self.unchanged, counts.unchanged as u64);
        add(&self.without, counts.without as u64);
        if counts.sets > 0 {
            add(&self.sets, counts.sets as u64);
            add(&self.set_bytes, bytes as u64);
            add(&self.set_us, took_us);
        }
    }

    /// Bytes and milliseconds that were saved: a mean set for each one that was left as it was, which making it anew would have taken.
    pub fn saved(&self) -> (f64, f64) {
        let number = |of: &AtomicU64| of.load(Ordering::Relaxed) as f64;
        let times = number(&self.unchanged) / number(&self.sets).max(1.0);
        (times * number(&self.set_bytes), times * number(&self.set_us) / 1e3)
    }

    fn json(&self) -> serde_json::Value {
        let (saved_bytes, saved_ms) = self.saved();
        serde_json::json!({
            "bytes": self.bytes.load(Ordering::Relaxed),
            "ms": self.took_us.load(Ordering::Relaxed) as f64 / 1e3,
            "sets": self.sets.load(Ordering::Relaxed),
            "unchanged": self.unchanged.load(Ordering::Relaxed),
            "without": self.without.load(Ordering::Relaxed),
            "saved_bytes": saved_bytes.round(),
            "saved_ms": saved_ms,
        })
    }
}

/// Memory of this process that is in RAM; `None` where the system does not tell.
pub fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kib| kib * 1024)
}
