//! What a running server counts. Shared by all sessions; read by `/healthz` and tests.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use crate::plan::Reason;

/// Counters since the server started.
#[derive(Debug, Default)]
pub struct Stats {
    /// Sessions now.
    pub clients: AtomicUsize,
    /// Sessions ever.
    pub connected: AtomicU64,
    /// Sessions that the server ended: misbehaviour and slow reading.
    pub cut_off: AtomicU64,
    /// Updates handed to sessions.
    pub updates: AtomicU64,
    /// Bytes handed to sockets.
    pub sent_bytes: AtomicU64,
    looks: [AtomicU64; Reason::ALL.len()],
}

impl Stats {
    /// Counts an update.
    pub fn count_look(&self, reason: Reason) {
        self.looks[reason as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Updates made for a reason.
    pub fn looks(&self, reason: Reason) -> u64 {
        self.looks[reason as usize].load(Ordering::Relaxed)
    }

    /// As JSON, for `/healthz`.
    pub fn json(&self) -> serde_json::Value {
        let looks: serde_json::Map<_, _> =
            Reason::ALL.iter().map(|&reason| (reason.name().to_owned(), self.looks(reason).into())).collect();
        serde_json::json!({
            "clients": self.clients.load(Ordering::Relaxed),
            "connected": self.connected.load(Ordering::Relaxed),
            "cut_off": self.cut_off.load(Ordering::Relaxed),
            "updates": self.updates.load(Ordering::Relaxed),
            "sent_bytes": self.sent_bytes.load(Ordering::Relaxed),
            "looks": looks,
            "resident_bytes": resident_bytes(),
        })
    }
}

/// Memory of this process that is in RAM; `None` where the system does not tell.
pub fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kib| kib * 1024)
}
