//! Audiences: many clients that follow one presenter. What he is sent is looked for once and encoded once, and the same buffers go to all.
//!
//! A presenter's session hands over every update that it sends ([`Presenting::publish`]); followers' sessions take them one after the other, each as
//! fast as its own path goes ([`Following::next_update`]). Who comes late, or falls so far behind that updates are gone, first gets the whole copy of the
//! moment ([`protocol::Held::whole`]), which is made once for all who lack it then. When a presenter leaves, his followers keep what they hold; the
//! next one by his name takes them over, and numbers go on.
//!
//! Neither end need be a client: a server that publishes follows for its relays, and a relay presents what it hears.

mod log;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use camera::Rigid;
use protocol::message::ServerMessage;
use protocol::staging::Playback;
use protocol::wire::{Envelope, PackedUpdate, encode_server};
use tokio::sync::{Notify, watch};

use log::{Log, Next};

/// A whole copy that is older than this is not given to who could not hold what he was given: it may be at fault.
const WHOLE_IS_TRUSTED_FOR: Duration = Duration::from_secs(10);

/// All audiences of a server, by name. One is there as long as somebody presents or follows.
#[derive(Debug, Default)]
pub struct Audiences {
    by_name: Mutex<BTreeMap<String, Arc<Audience>>>,
    /// No update of an audience that has ended has a greater number: those that begin go on from here, so that none comes twice by one name.
    ended_at: AtomicU64,
}

#[derive(Debug)]
struct Audience {
    state: Mutex<State>,
    /// Counts what followers may be told.
    news: watch::Sender<u64>,
    /// Told when a whole copy is wanted.
    wanted: Notify,
}

#[derive(Debug, Default)]
struct State {
    log: Log,
    has_presenter: bool,
    followers: usize,
    wants_whole: bool,
    /// Counts whole copies.
    wholes: u64,
    whole_since: Option<Instant>,
    /// Counts places of the presenter's eye, with the messages that tell the last one.
    eye: Option<(u64, Vec<Bytes>)>,
}

impl Audience {
    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    fn want_whole(&self, state: &mut State) {
        state.wants_whole = true;
        self.wanted.notify_one();
    }

    fn tell(&self) {
        self.news.send_modify(|count| *count += 1);
    }
}

/// A state that a panic left is as whole as any: each change is one assignment or more that stand for themselves.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Audiences {
    /// Begins to present; `None` where somebody does by this name already.
    pub fn present(self: &Arc<Self>, name: &str) -> Option<Presenting> {
        let seat = self.seat(name, |state| !std::mem::replace(&mut state.has_presenter, true))?;
        Some(Presenting { seat })
    }

    /// Begins to follow, whether or not somebody presents yet.
    pub fn follow(self: &Arc<Self>, name: &str) -> Following {
        let join = |state: &mut State| {
            state.followers += 1;
            true
        };
        let seat = self.seat(name, join).expect("who follows is always taken in");
        let mut news = seat.audience.news.subscribe();
        news.mark_changed();
        Following { seat, news, held: None, told_eye: 0, taken_wholes: 0 }
    }

    /// Who presents, and the number of the newest update of each.
    pub fn presenters(&self) -> Vec<(String, u64)> {
        let by_name = lock(&self.by_name);
        let state = |(name, audience): (&String, &Arc<Audience>)| {
            let state = audience.state();
            state.has_presenter.then(|| (name.clone(), state.log.last()))
        };
        by_name.iter().filter_map(state).collect()
    }

    /// Whether anybody presents by a name.
    pub fn has_presenter(&self, name: &str) -> bool {
        lock(&self.by_name).get(name).is_some_and(|audience| audience.state().has_presenter)
    }

    /// The names of those who are followed.
    pub fn followed(&self) -> Vec<String> {
        let by_name = lock(&self.by_name);
        by_name.iter().filter(|(_, audience)| audience.state().followers > 0).map(|(name, _)| name.clone()).collect()
    }

    /// A seat in an audience that lets one in.
    fn seat(self: &Arc<Self>, name: &str, lets_in: impl FnOnce(&mut State) -> bool) -> Option<Seat> {
        let mut by_name = lock(&self.by_name);
        let new = || {
            let log = Log::after(self.ended_at.load(Ordering::Relaxed));
            let state = Mutex::new(State { log, ..State::default() });
            Arc::new(Audience { state, news: watch::Sender::new(0), wanted: Notify::new() })
        };
        let audience = by_name.entry(name.to_owned()).or_insert_with(new).clone();
        let is_in = lets_in(&mut audience.state());
        is_in.then(|| Seat { name: name.to_owned(), audience, audiences: self.clone() })
    }
}

/// A place in an audience.
#[derive(Debug)]
struct Seat {
    name: String,
    audience: Arc<Audience>,
    audiences: Arc<Audiences>,
}

impl Seat {
    /// Gives the place back; an audience without anybody ends.
    fn leave(&self, give_back: impl FnOnce(&mut State)) {
        let mut by_name = lock(&self.audiences.by_name);
        let mut state = self.audience.state();
        give_back(&mut state);
        if !state.has_presenter && state.followers == 0 {
            self.audiences.ended_at.fetch_max(state.log.last(), Ordering::Relaxed);
            by_name.remove(&self.name);
        }
    }
}

/// Held by who presents. Dropping it ends that.
#[derive(Debug)]
pub struct Presenting {
    seat: Seat,
}

impl Presenting {
    /// The last update that went to followers; before any, one that the next must come after, or 0.
    pub fn last(&self) -> u64 {
        self.seat.audience.state().log.last()
    }

    /// Says on behalf of followers that they need the whole copy.
    pub fn ask_whole(&self) {
        self.seat.audience.want_whole(&mut self.seat.audience.state());
    }

    /// Gives followers what the presenter was sent.
    pub fn publish(&self, update: PackedUpdate) {
        let mut state = self.seat.audience.state();
        let is_followed = state.followers > 0;
        state.log.push(update, is_followed);
        drop(state);
        self.seat.audience.tell();
    }

    /// Whether somebody needs the whole copy.
    pub fn is_asked(&self) -> bool {
        self.seat.audience.state().wants_whole
    }

    /// Waits until somebody may need it.
    pub async fn asked(&self) {
        self.seat.audience.wanted.notified().await;
    }

    /// Gives followers the whole copy of now.
    pub fn publish_whole(&self, whole: PackedUpdate) {
        let mut state = self.seat.audience.state();
        state.wants_whole = false;
        state.wholes += 1;
        state.whole_since = Some(Instant::now());
        state.log.put_whole(whole);
        drop(state);
        self.seat.audience.tell();
    }

    /// Tells followers where the presenter's eye is at a time, and how the time goes of what he is shown.
    pub fn look_from(&self, world_from_eye: Rigid, playback: Playback, at_s: f64) {
        let messages =
            encode_server(&Envelope { at_s, message: ServerMessage::Presenter { world_from_eye, playback } });
        let mut state = self.seat.audience.state();
        let count = state.eye.as_ref().map_or(0, |(count, _)| *count);
        state.eye = Some((count + 1, messages));
        drop(state);
        self.seat.audience.tell();
    }
}

impl Drop for Presenting {
    fn drop(&mut self) {
        self.seat.leave(|state| state.has_presenter = false);
    }
}

/// Held by who follows. Dropping it ends that.
#[derive(Debug)]
pub struct Following {
    seat: Seat,
    news: watch::Receiver<u64>,
    /// The update that was sent last; `None` where none follows what the client holds.
    held: Option<u64>,
    told_eye: u64,
    /// Of the whole copies.
    taken_wholes: u64,
}

impl Following {
    /// Waits until there may be something new.
    pub async fn changed(&mut self) {
        if self.news.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// What to send next, which counts as sent; `None` while there is nothing new or the whole copy is still to be made.
    pub fn next_update(&mut self) -> Option<PackedUpdate> {
        let mut state = self.seat.audience.state();
        match state.log.next(self.held) {
            Next::Nothing => None,
            Next::Update(update) => {
                self.held = Some(update.number);
                Some(update)
            }
            Next::Whole => {
                self.seat.audience.want_whole(&mut state);
                None
            }
        }
    }

    /// What the client held is lost: the next update begins anew.
    pub fn begin_anew(&mut self) {
        self.held = None;
        let mut state = self.seat.audience.state();
        if state.whole_since.is_some_and(|since| since.elapsed() > WHOLE_IS_TRUSTED_FOR) {
            state.log.drop_whole();
        }
    }

    /// All that there is so far counts as sent.
    pub fn skip(&mut self) {
        self.held = Some(self.seat.audience.state().log.last());
    }

    /// Asks for the whole copy of now, whatever was sent: [`Following::whole`] gives it.
    pub fn ask_whole(&mut self) {
        let mut state = self.seat.audience.state();
        if state.log.whole().is_some_and(|whole| whole.number == state.log.last()) {
            // Nothing has happened since.
            self.taken_wholes = state.wholes - 1;
        } else {
            self.taken_wholes = state.wholes;
            self.seat.audience.want_whole(&mut state);
        }
    }

    /// The newest whole copy, once.
    pub fn whole(&mut self) -> Option<PackedUpdate> {
        let state = self.seat.audience.state();
        let whole = state.log.whole().filter(|_| state.wholes > self.taken_wholes).cloned();
        self.taken_wholes = state.wholes;
        whole
    }

    /// The messages that tell where the presenter's eye is, where it was not told yet.
    pub fn eye(&mut self) -> Option<Vec<Bytes>> {
        let state = self.seat.audience.state();
        let (count, messages) = state.eye.as_ref().filter(|(count, _)| *count > self.told_eye)?;
        self.told_eye = *count;
        Some(messages.clone())
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.seat.leave(|state| {
            state.followers -= 1;
            if state.followers == 0 {
                state.log.forget();
                state.wants_whole = false;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_presents_and_an_empty_audience_ends() {
        let audiences = Arc::new(Audiences::default());
        let presenting = audiences.present("Ada").expect("nobody else presents");
        assert!(audiences.present("Ada").is_none());
        assert!(audiences.present("Grace").is_some(), "by another name");
        let following = audiences.follow("Ada");
        drop(presenting);
        assert_eq!(lock(&audiences.by_name).len(), 1, "who follows waits for the next one");
        let next = audiences.present("Ada").expect("the place is free");
        drop(following);
        assert!(audiences.present("Ada").is_none());
        drop(next);
        assert!(lock(&audiences.by_name).is_empty());
    }

    fn update(number: u64, clears: bool) -> PackedUpdate {
        PackedUpdate { number, digest: 0, clears, bytes: 10, fragments: Vec::new().into() }
    }

    #[test]
    fn no_number_comes_twice_by_one_name() {
        let audiences = Arc::new(Audiences::default());
        let presenting = audiences.present("Ada").expect("free");
        presenting.publish(update(5, false));
        assert_eq!(audiences.presenters(), [("Ada".to_owned(), 5)]);
        drop(presenting);
        assert!(audiences.presenters().is_empty() && audiences.by_name.lock().is_ok_and(|by_name| by_name.is_empty()));
        assert_eq!(audiences.present("Ada").expect("free").last(), 5);
    }

    #[test]
    fn who_passes_on_takes_updates_and_whole_copies_apart() {
        let audiences = Arc::new(Audiences::default());
        let (presenting, mut following) = (audiences.present("Ada").expect("free"), audiences.follow("Ada"));
        presenting.publish(update(1, false));
        following.skip();
        presenting.publish(update(2, false));
        assert_eq!(following.next_update(), Some(update(2, false)));
        assert!(following.next_update().is_none() && !presenting.is_asked() && following.whole().is_none());
        following.ask_whole();
        assert!(presenting.is_asked());
        presenting.publish_whole(update(2, true));
        assert_eq!(following.whole(), Some(update(2, true)));
        assert_eq!((following.whole(), following.next_update()), (None, None));
        following.ask_whole();
        assert!(!presenting.is_asked(), "it is still of now");
        assert_eq!(following.whole(), Some(update(2, true)));
    }

    #[test]
    fn a_follower_who_must_clear_waits_for_a_beginning() {
        let audiences = Arc::new(Audiences::default());
        let (presenting, mut following) = (audiences.present("Ada").expect("free"), audiences.follow("Ada"));
        presenting.publish(update(1, false));
        assert!(following.next_update().is_none() && presenting.is_asked());
        presenting.publish_whole(update(1, true));
        assert!(!presenting.is_asked());
        assert_eq!(following.next_update().map(|update| (update.number, update.clears)), Some((1, true)));
        presenting.publish(update(2, false));
        assert_eq!(following.next_update().map(|update| update.number), Some(2));
        assert_eq!(following.next_update(), None);
        following.begin_anew();
        assert_eq!(following.next_update().map(|update| update.number), Some(1), "the copy and what followed it");
        assert_eq!(following.next_update().map(|update| update.number), Some(2));
    }
}
