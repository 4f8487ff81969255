//! What all of a relay knows: its broker, its limits, the server that is relayed, and counts.

use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::{Notify, Semaphore, watch};

use super::origin::Origin;
use crate::broker::Broker;
use crate::limits::ServerLimits;
use crate::session::Over;
use crate::stats::Stats;

/// What all sessions of a relay share.
pub struct Relay {
    pub(super) broker: Broker,
    pub(super) limits: ServerLimits,
    /// What sessions count.
    pub stats: Arc<Stats>,
    /// What is heard.
    pub heard: Heard,
    pub(super) origin: Mutex<Option<Arc<Origin>>>,
    /// One permit a session.
    pub(super) places: Arc<Semaphore>,
    /// Told when what is asked for may be another.
    pub(super) asks: Notify,
    pub(super) over: watch::Sender<Option<Over>>,
}

/// What a relay counts of the broker's messages.
#[derive(Debug, Default)]
pub struct Heard {
    /// Updates that were passed on.
    pub updates: AtomicU64,
    /// Whole copies.
    pub wholes: AtomicU64,
    /// Bytes of messages.
    pub bytes: AtomicU64,
    /// Updates that did not follow the one before: something was lost.
    pub gaps: AtomicU64,
    /// Messages that made no sense.
    pub refused: AtomicU64,
    /// Presenters that are listened to now.
    pub followed: AtomicUsize,
}

impl Relay {
    /// The same, to be replaced.
    pub(super) fn origin(&self) -> MutexGuard<'_, Option<Arc<Origin>>> {
        // What a panic leaves is one server or another.
        self.origin.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a server was heard yet.
    pub fn knows_a_server(&self) -> bool {
        self.origin().is_some()
    }

    /// The server that is relayed, or why there is none.
    pub(super) fn relayed(&self) -> Result<Arc<Origin>, String> {
        let nobody = || {
            let Broker { address, channel } = &self.broker;
            format!("no server has published as {channel:?} at {address} yet")
        };
        self.origin().clone().ok_or_else(nobody)
    }
}
