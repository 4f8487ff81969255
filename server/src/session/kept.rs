//! Sessions that were cut off, kept for a while for the clients that come back.
//!
//! A session is known by a secret that only its client was told. While it runs, whoever names it takes it over: the connection that it had may be dead without
//! the server knowing, and so may the one that took it over. After that it stays for [`ResumeLimits::time`], as long as all that are kept, of all scenes, fit into [`ResumeLimits::bytes`].
//! Who comes for another scene finds nothing of it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use protocol::session::Trail;
use tokio::sync::{Notify, oneshot};
use tokio::time::Instant;

use crate::account::BYTES_PER_SAMPLE;
use crate::client::Client;
use crate::limits::ResumeLimits;

/// What a session that runs may take to give way to a connection that goes on with it: a turn at the worker. Longer than a client waits for a welcome when it
/// comes back: the connection that it makes after that takes over from the one that still waits here.
pub const GIVES_WAY_WITHIN: Duration = Duration::from_secs(10);

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

/// Which scene of the server, among all that it ever opened.
pub type SceneNumber = u64;

/// What a session is found by.
type Key = (SceneNumber, u128);

/// How a session that runs is known.
#[derive(Debug, Default)]
pub struct Name {
    scene: SceneNumber,
    /// Its own for ever, known to nobody else.
    own: u128,
    /// The one that its client is told: that of the session that it goes on with, if any.
    pub secret: u128,
}

/// A request to give way, and where to put what is left.
pub type GiveWay = oneshot::Sender<Left>;

enum Entry {
    Running { own: u128, asks: oneshot::Sender<GiveWay> },
    Kept { left: Left, since: Instant },
}

/// See the module.
#[derive(Clone)]
pub struct KeptSessions {
    limits: ResumeLimits,
    by_secret: Arc<Mutex<HashMap<Key, Entry>>>,
    /// Told when something that was kept is dropped.
    dropped: Arc<Notify>,
}

impl KeptSessions {
    /// None yet. `dropped` is told when something that was kept is dropped.
    pub fn new(limits: ResumeLimits, dropped: Arc<Notify>) -> KeptSessions {
        KeptSessions { limits, by_secret: Arc::default(), dropped }
    }

    /// A session of a scene begins: its name, and what tells it to give way.
    pub fn begin(&self, scene: SceneNumber) -> Result<(Name, oneshot::Receiver<GiveWay>), getrandom::Error> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)?;
        let own = u128::from_le_bytes(bytes);
        let (asks, asked) = oneshot::channel();
        self.lock().insert((scene, own), Entry::Running { own, asks });
        Ok((Name { scene, own, secret: own }, asked))
    }

    /// What is left of the session that a client names, which is over. From now on the one that asks has its secret, as its client may be cut off again before
    /// it is told another. `None` where there is no such session, or nothing is left of it.
    pub async fn take_over(&self, name: &mut Name, secret: u128) -> Option<Left> {
        let earlier = {
            let mut entries = self.lock();
            let earlier = entries.remove(&(name.scene, secret))?;
            if let Some(own) = entries.remove(&name.key()) {
                entries.insert((name.scene, secret), own);
            }
            name.secret = secret;
            earlier
        };
        match earlier {
            Entry::Kept { left, since } => (since.elapsed() < self.limits.time).then_some(left),
            Entry::Running { asks, .. } => {
                let (gives, given) = oneshot::channel();
                asks.send(gives).ok()?;
                tokio::time::timeout(GIVES_WAY_WITHIN, given).await.ok()?.ok()
            }
        }
    }

    /// A session was cut off. Gives back what is left where a connection has just asked for it: it waits to be given that.
    pub fn keep(&self, name: &Name, left: Left) -> Option<Left> {
        let mut entries = self.lock();
        let key = name.key();
        if !name.is_of(entries.get(&key)) {
            return Some(left);
        }
        entries.insert(key, Entry::Kept { left, since: Instant::now() });
        while kept_bytes(&entries) > self.limits.bytes {
            let oldest = entries.iter().filter_map(|(key, entry)| entry.kept_since().map(|since| (since, *key))).min();
            let Some((_, key)) = oldest else { break };
            entries.remove(&key);
            self.dropped.notify_one();
        }
        drop(entries);
        let (kept, time) = (self.clone(), self.limits.time);
        tokio::spawn(async move {
            tokio::time::sleep(time).await;
            kept.forget_old(key);
        });
        None
    }

    /// A session is over that nobody will come back to.
    pub fn forget(&self, name: &Name) {
        let mut entries = self.lock();
        if name.is_of(entries.get(&name.key())) {
            entries.remove(&name.key());
        }
    }

    /// Nobody will come back to any that is kept of a scene.
    pub fn forget_all(&self, scene: SceneNumber) {
        self.lock().retain(|(of, _), entry| *of != scene || entry.kept_since().is_none());
        self.dropped.notify_one();
    }

    /// What was kept for too long; a session that goes on by now, or was cut off again since, stays.
    fn forget_old(&self, key: Key) {
        let is_old = |entry: &Entry| entry.kept_since().is_some_and(|since| since.elapsed() >= self.limits.time);
        let mut entries = self.lock();
        if entries.get(&key).is_some_and(is_old) {
            entries.remove(&key);
            self.dropped.notify_one();
        }
    }

    /// How many are kept.
    pub fn count(&self) -> usize {
        self.lock().values().filter(|entry| entry.kept_since().is_some()).count()
    }

    /// Whether some are kept of a scene.
    pub fn has_some_of(&self, scene: SceneNumber) -> bool {
        self.lock().iter().any(|((of, _), entry)| *of == scene && entry.kept_since().is_some())
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Key, Entry>> {
        self.by_secret.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Name {
    fn key(&self) -> Key {
        (self.scene, self.secret)
    }

    /// Whether this entry is of its session.
    fn is_of(&self, entry: Option<&Entry>) -> bool {
        matches!(entry, Some(Entry::Running { own, .. }) if *own == self.own)
    }
}

impl Entry {
    fn kept_since(&self) -> Option<Instant> {
        match self {
            Entry::Running { .. } => None,
            Entry::Kept { since, .. } => Some(*since),
        }
    }
}

fn kept_bytes(entries: &HashMap<Key, Entry>) -> u64 {
    let bytes = |entry: &Entry| match entry {
        Entry::Running { .. } => 0,
        Entry::Kept { left, .. } => left.bytes(),
    };
    entries.values().map(bytes).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: SceneNumber = 3;

    fn left() -> Left {
        Left { client: Box::default(), trail: Trail::default() }
    }

    fn kept(time: Duration) -> KeptSessions {
        KeptSessions::new(ResumeLimits { time, bytes: u64::MAX }, Arc::default())
    }

    /// A session that has begun: its name, and where it is told to give way.
    fn begun(kept: &KeptSessions) -> (Name, oneshot::Receiver<GiveWay>) {
        kept.begin(SCENE).expect("random bytes")
    }

    #[tokio::test]
    async fn is_there_once_and_for_who_knows_its_secret() {
        let kept = kept(Duration::from_secs(60));
        let [(first, _asked), (mut second, _asked_too), (mut third, _asked_last)] =
            [begun(&kept), begun(&kept), begun(&kept)];
        assert!(kept.keep(&first, left()).is_none());
        assert_eq!(kept.count(), 1);
        assert!(kept.take_over(&mut second, first.secret ^ 1).await.is_none());
        assert!(kept.take_over(&mut second, first.secret).await.is_some());
        assert_eq!(second.secret, first.secret, "its client may be cut off before it is told another");
        assert_eq!(kept.count(), 0);
        assert!(kept.take_over(&mut third, first.secret ^ 1).await.is_none());
    }

    #[tokio::test]
    async fn is_of_its_scene_alone() {
        let kept = kept(Duration::from_secs(60));
        let (first, _asked) = begun(&kept);
        let (mut elsewhere, _asked_too) = kept.begin(SCENE + 1).expect("random bytes");
        assert!(kept.keep(&first, left()).is_none());
        assert!(kept.take_over(&mut elsewhere, first.secret).await.is_none());
        assert!(kept.has_some_of(SCENE) && !kept.has_some_of(SCENE + 1));
        kept.forget_all(SCENE + 1);
        assert_eq!(kept.count(), 1);
        kept.forget_all(SCENE);
        assert_eq!(kept.count(), 0);
    }

    #[tokio::test]
    async fn who_takes_over_may_be_taken_over_before_it_is_given_anything() {
        let kept = kept(Duration::from_secs(60));
        let [(first, asked), (mut second, asked_second), (mut third, _asked_third)] =
            [begun(&kept), begun(&kept), begun(&kept)];
        let (one, other, name) = (kept.clone(), kept.clone(), first.secret);
        let second = tokio::spawn(async move { (one.take_over(&mut second, name).await, second) });
        let gives = asked.await.expect("asked");
        let third = tokio::spawn(async move { other.take_over(&mut third, name).await });
        let gives_on = asked_second.await.expect("asked");
        // The first one is cut off just now; the second one waits for what is left of it.
        let back = kept.keep(&first, left()).expect("another has its name");
        gives.send(back).expect("awaited");
        let (left, second) = second.await.expect("it ends");
        gives_on.send(left.expect("what is left")).expect("awaited");
        kept.forget(&second);
        assert!(third.await.expect("it ends").is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn is_forgotten_in_time() {
        let kept = kept(Duration::from_secs(60));
        let (name, _asked) = begun(&kept);
        assert!(kept.keep(&name, left()).is_none());
        tokio::time::sleep(Duration::from_secs(59)).await;
        assert_eq!(kept.count(), 1);
        tokio::time::sleep(Duration::from_secs(2)).await;
        assert_eq!(kept.count(), 0);
        tokio::time::timeout(Duration::from_secs(1), kept.dropped.notified()).await.expect("it is told");
    }
}
