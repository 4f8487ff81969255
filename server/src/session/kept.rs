//! Sessions that were cut off, kept for a while for the clients that come back.
//!
//! A session is known by a secret that only its client was told. While it runs, whoever names it takes it over: the connection that it had may be dead without
//! the server knowing. After that it stays for [`ResumeLimits::time`], as long as all that are kept fit into [`ResumeLimits::bytes`].

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use protocol::session::Trail;
use tokio::sync::oneshot;

use crate::account::BYTES_PER_SAMPLE;
use crate::client::Client;
use crate::config::ResumeLimits;

/// What a session that runs may take to give way to a connection that goes on with it: a turn at the worker.
pub const GIVES_WAY_WITHIN: Duration = Duration::from_secs(2);

/// What is left of a session.
#[derive(Debug)]
pub struct Left {
    /// What its client was sent.
    pub client: Box<Client>,
    /// What of it the client may lack.
    pub trail: Trail,
}

impl Left {
    fn bytes(&self) -> u64 {
        self.client.account.held().sample_count() as u64 * BYTES_PER_SAMPLE + self.trail.bytes() as u64
    }
}

/// A request to give way, and where to put what is left.
pub type GiveWay = oneshot::Sender<Left>;

enum Entry {
    Running(oneshot::Sender<GiveWay>),
    Kept { left: Left, since: Instant },
}

/// See the module.
#[derive(Clone)]
pub struct KeptSessions {
    limits: ResumeLimits,
    by_secret: Arc<Mutex<HashMap<u128, Entry>>>,
}

impl KeptSessions {
    /// None yet.
    pub fn new(limits: ResumeLimits) -> KeptSessions {
        KeptSessions { limits, by_secret: Arc::default() }
    }

    /// A session begins: its secret, and what tells it to give way.
    pub fn begin(&self) -> Result<(u128, oneshot::Receiver<GiveWay>), getrandom::Error> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)?;
        let secret = u128::from_le_bytes(bytes);
        let (asks, asked) = oneshot::channel();
        self.lock().insert(secret, Entry::Running(asks));
        Ok((secret, asked))
    }

    /// What is left of a session; it is over. `None` where nothing is.
    pub async fn take(&self, secret: u128) -> Option<Left> {
        let entry = self.lock().remove(&secret)?;
        match entry {
            Entry::Kept { left, since } => (since.elapsed() < self.limits.time).then_some(left),
            Entry::Running(asks) => {
                let (gives, given) = oneshot::channel();
                asks.send(gives).ok()?;
                tokio::time::timeout(GIVES_WAY_WITHIN, given).await.ok()?.ok()
            }
        }
    }

    /// A session was cut off. Gives back what is left where a connection has just asked for it: it waits to be given that.
    pub fn keep(&self, secret: u128, left: Left) -> Option<Left> {
        let mut entries = self.lock();
        if entries.remove(&secret).is_none() {
            return Some(left);
        }
        entries.insert(secret, Entry::Kept { left, since: Instant::now() });
        while kept_bytes(&entries) > self.limits.bytes {
            let oldest =
                entries.iter().filter_map(|(secret, entry)| entry.kept_since().map(|since| (since, *secret))).min();
            let Some((_, secret)) = oldest else { break };
            entries.remove(&secret);
        }
        drop(entries);
        let (kept, time) = (self.clone(), self.limits.time);
        tokio::spawn(async move {
            tokio::time::sleep(time).await;
            kept.forget(secret);
        });
        None
    }

    /// Nobody will come back to a session.
    pub fn forget(&self, secret: u128) {
        self.lock().remove(&secret);
    }

    /// How many are kept.
    pub fn count(&self) -> usize {
        self.lock().values().filter(|entry| entry.kept_since().is_some()).count()
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<u128, Entry>> {
        self.by_secret.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entry {
    fn kept_since(&self) -> Option<Instant> {
        match self {
            Entry::Running(_) => None,
            Entry::Kept { since, .. } => Some(*since),
        }
    }
}

fn kept_bytes(entries: &HashMap<u128, Entry>) -> u64 {
    let bytes = |entry: &Entry| match entry {
        Entry::Running(_) => 0,
        Entry::Kept { left, .. } => left.bytes(),
    };
    entries.values().map(bytes).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left() -> Left {
        Left { client: Box::default(), trail: Trail::default() }
    }

    fn kept(time: Duration) -> KeptSessions {
        KeptSessions::new(ResumeLimits { time, bytes: u64::MAX })
    }

    #[tokio::test]
    async fn is_there_once_and_for_who_knows_its_secret() {
        let kept = kept(Duration::from_secs(60));
        let (secret, _asked) = kept.begin().expect("random bytes");
        assert!(kept.keep(secret, left()).is_none());
        assert_eq!(kept.count(), 1);
        assert!(kept.take(secret ^ 1).await.is_none());
        assert!(kept.take(secret).await.is_some());
        assert!(kept.take(secret).await.is_none());
    }

    #[tokio::test]
    async fn a_session_that_runs_gives_way() {
        let kept = kept(Duration::from_secs(60));
        let (secret, asked) = kept.begin().expect("random bytes");
        let runs = tokio::spawn(async move { asked.await.expect("asked").send(left()).is_ok() });
        assert!(kept.take(secret).await.is_some());
        assert!(runs.await.expect("it ends"));
        assert!(kept.keep(secret, left()).is_some(), "it is another's now");
        assert_eq!(kept.count(), 0);
    }

    #[tokio::test(start_paused = true)]
    async fn is_forgotten_in_time() {
        let kept = kept(Duration::from_secs(60));
        let (secret, _asked) = kept.begin().expect("random bytes");
        assert!(kept.keep(secret, left()).is_none());
        tokio::time::sleep(Duration::from_secs(61)).await;
        assert_eq!(kept.count(), 0);
    }
}
