//! A client of a run, what it saw, and what it shares with the others.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

use camera::Trace;
use protocol::message::{Clock, Role, Welcome};
use serde::Serialize;
use tokio::sync::Notify;

use super::quality::Moment;
use super::script::Behaviour;
use super::series::{Counters, Timed};

/// What all clients of a run share.
pub(super) struct Shared {
    /// Of the server's websocket.
    pub url: String,
    /// Of those where followers connect; none: the server's.
    pub followed_at: Vec<String>,
    /// What the copy of an audience comes to by each update, as whoever heard it first was told.
    pub digests: Mutex<HashMap<u64, u64>>,
    /// Empty: made paths.
    pub traces: Vec<Trace>,
    /// Which clock the server runs.
    pub clock: Clock,
    /// Second 0 of everything.
    pub started: Instant,
    /// Whether what the first clients hold is kept at moments, to be drawn.
    pub keeps_moments: bool,
    /// What all of them count.
    pub counters: Arc<Counters>,
    /// The name by which the first client presents and all others follow; `None` where each goes his own way.
    pub audience: Option<String>,
    /// So many clients decode what they get; the others acknowledge it by what its head says, which is what their server sees of it.
    pub decoding: usize,
    /// What the server greeted the first client with.
    pub welcome: OnceLock<Welcome>,
    /// Told when the last client has left.
    pub is_over: Notify,
}

impl Shared {
    pub fn role(&self, index: usize) -> Role {
        match &self.audience {
            None => Role::Viewer,
            Some(name) if index == 0 => Role::Presenter(name.clone()),
            Some(name) => Role::Follower(name.clone()),
        }
    }

    /// Where a client connects.
    pub fn url(&self, index: usize) -> &str {
        let relay =
            index.checked_sub(1).and_then(|follower| self.followed_at.get(follower % self.followed_at.len().max(1)));
        relay.unwrap_or(&self.url)
    }

    /// Whether an update of the audience comes to the same copy as for all others.
    pub fn is_the_same(&self, number: u64, digest: u64) -> bool {
        let mut digests = self.digests.lock().unwrap_or_else(PoisonError::into_inner);
        *digests.entry(number).or_insert(digest) == digest
    }

    /// The time now in seconds of the run.
    pub fn now_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}

/// Which client, what it does and when, in seconds of the run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Client {
    pub index: usize,
    pub behaviour: Behaviour,
    pub comes_s: f64,
    pub ends_s: f64,
}

/// What one client saw, in all of its visits.
#[derive(Debug, Default, Serialize)]
pub struct ClientReport {
    /// From 0.
    pub index: usize,
    /// What it did.
    pub behaviour: Behaviour,
    /// Updates held or, by who does not decode, acknowledged.
    pub updates: u64,
    /// Of an audience: updates that neither followed the one before nor began anew.
    pub gaps: u64,
    /// Of an audience: updates that came to another copy than somebody else's.
    pub strays: u64,
    /// Bytes received, without the transport's own.
    pub bytes: u64,
    /// Samples held at the end.
    pub held_samples: usize,
    /// How often it came back.
    pub reconnections: u64,
    /// Pose sent to its update decoded; one value a pose that an update answered.
    #[serde(skip)]
    pub latencies: Vec<Timed>,
    /// From the server's stamp of an update to its last byte here, by the clock that pings agree on; on the wall clock.
    #[serde(skip)]
    pub lags: Vec<Timed>,
    /// From the open connection to the first update held, one value a visit.
    #[serde(skip)]
    pub first_updates: Vec<Timed>,
    /// Between updates, the first one's of a visit excepted.
    #[serde(skip)]
    pub intervals: Vec<Timed>,
    /// What it held now and then, if that was asked for.
    #[serde(skip)]
    pub moments: Vec<Moment>,
    /// Their mean.
    pub mean_interval_ms: f64,
    /// Their longest.
    pub max_interval_ms: f64,
    /// Why it ended early.
    pub error: Option<String>,
}

impl ClientReport {
    /// The longest interval by the mean one; not a number with fewer than two intervals.
    pub fn longest_interval_by_mean(&self) -> f64 {
        if self.intervals.len() < 2 { f64::NAN } else { self.max_interval_ms / self.mean_interval_ms }
    }
}
