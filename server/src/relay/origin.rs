//! The server that is relayed: one run of it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use protocol::message::Welcome;
use tokio::sync::watch;

use crate::audience::Audiences;
use crate::broker::notes::Notice;
use crate::session::link::SessionClock;

/// A server that says nothing for so long, though it is asked, may be replaced by another one of its channel.
const SILENT_AFTER: Duration = Duration::from_secs(3);

/// See the module. What a later run would send does not go on from what an earlier one sent, so each has audiences of its own.
#[derive(Debug)]
pub(super) struct Origin {
    id: u64,
    /// Said to every client, but for the time.
    pub welcome: Welcome,
    /// The server's own, as far as the way from there is short: scene time goes by it.
    pub clock: SessionClock,
    /// Whom followers here belong to.
    pub audiences: Arc<Audiences>,
    told: Mutex<Told>,
    replaced: watch::Sender<bool>,
}

#[derive(Debug)]
struct Told {
    at: Instant,
    /// Who presents, and his newest update.
    presenters: BTreeMap<String, u64>,
}

impl Origin {
    /// As its first notice says.
    pub fn new(notice: Notice) -> Origin {
        let origin = Origin {
            id: notice.origin,
            welcome: notice.welcome.clone(),
            clock: SessionClock::at(notice.now_s),
            audiences: Arc::default(),
            told: Mutex::new(Told { at: Instant::now(), presenters: BTreeMap::new() }),
            replaced: watch::Sender::new(false),
        };
        origin.hear(notice);
        origin
    }

    /// Tells it from all others.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Takes in what it says of itself now; gives what it said before of who presents.
    pub fn hear(&self, notice: Notice) -> BTreeMap<String, u64> {
        let presenters = notice.presenters.into_iter().map(|presenter| (presenter.name, presenter.last)).collect();
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *told, Told { at: Instant::now(), presenters }).presenters
    }

    /// Whether it has not been heard for long.
    pub fn is_silent(&self) -> bool {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).at.elapsed() >= SILENT_AFTER
    }

    /// Who presented when it was last heard.
    pub fn presenters(&self) -> Vec<String> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).presenters.keys().cloned().collect()
    }

    /// The newest update of a presenter, as it was last heard.
    pub fn newest(&self, name: &str) -> Option<u64> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).presenters.get(name).copied()
    }

    /// Another one is relayed from now on.
    pub fn replace(&self) {
        self.replaced.send_replace(true);
    }

    /// Waits until another one is relayed.
    pub async fn replaced(&self) {
        // The sender is here.
        let _ = self.replaced.subscribe().wait_for(|&replaced| replaced).await;
    }
}
