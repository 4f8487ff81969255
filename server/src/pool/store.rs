//! Where answers are kept: as many as fit, those that were asked for last.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::request::{Answer, Request};
use crate::account::Past;
use crate::imager::Occasion;

/// What a pool may take.
#[derive(Debug, Clone, Copy)]
pub struct Caps {
    /// All of it.
    pub bytes: usize,
    /// What was drawn ahead.
    pub ahead_bytes: usize,
    /// What nobody asked for so long is given back.
    pub unasked: Duration,
}

impl Default for Caps {
    /// All that looks from one place among `pillars` come to, at 512 x 512 pixels a view, takes 100 MB until nothing lacks any more; the coarse image, the first set
    /// and the rows at rest of it take 40. So there is room for a few places. A ring of views ahead alone takes 80 MB, and five of them are looked at in order:
    /// they may fill half of it, so that they never drive out what whoever comes next begins with. Whoever was sent a link opens it within minutes.
    fn default() -> Caps {
        Caps { bytes: 256 << 20, ahead_bytes: 128 << 20, unasked: Duration::from_secs(300) }
    }
}

/// An entry counts as so many bytes at least: as every one is compared with what is asked for, there are never more than a few thousand.
const LEAST_BYTES: usize = 64 << 10;

/// See the module.
#[derive(Debug, Default)]
pub struct Pool {
    caps: Caps,
    state: Mutex<State>,
    /// Told whenever something is no longer being drawn.
    changed: Condvar,
    drawn: AtomicU64,
    shared: AtomicU64,
    looks_shared: AtomicU64,
    pasts: AtomicU64,
}

#[derive(Debug, Default)]
struct State {
    /// Those asked for last stand last.
    entries: Vec<Entry>,
    /// Entries so far: names the next.
    number: u64,
}

#[derive(Debug)]
struct Entry {
    number: u64,
    request: Request,
    occasion: Occasion,
    asked_at: Instant,
    /// `None` while it is being drawn.
    answer: Option<Arc<Answer>>,
    bytes: usize,
}

/// What a thread is drawing, and will keep. However the drawing ends, by a panic too, nobody waits for it any longer.
struct Claim<'a> {
    pool: &'a Pool,
    number: u64,
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        self.pool.state().entries.retain(|entry| entry.number != self.number || entry.answer.is_some());
        self.pool.changed.notify_all();
    }
}

impl Pool {
    /// With other caps.
    pub fn new(caps: Caps) -> Pool {
        Pool { caps, ..Pool::default() }
    }

    /// What is kept of a request, or else what is drawn; that is kept where others may ask for the same. Who asks for what another thread is drawing waits
    /// for that thread. Nobody waits in a circle: a look asks for images meanwhile, but for no look, and what draws an image for nothing.
    pub fn answer<E>(
        &self,
        request: Request,
        occasion: Occasion,
        draw: impl FnOnce() -> Result<Answer, E>,
    ) -> Result<Arc<Answer>, E> {
        let claim = match self.find(request, occasion) {
            Ok(answer) => {
                self.shared.fetch_add(answer.count() as u64, Ordering::Relaxed);
                self.looks_shared.fetch_add(matches!(&*answer, Answer::Look(_)).into(), Ordering::Relaxed);
                return Ok(answer);
            }
            Err(claim) => claim,
        };
        let answer = Arc::new(draw()?);
        self.drawn.fetch_add(answer.count() as u64, Ordering::Relaxed);
        if let Some(claim) = claim {
            self.keep(claim.number, &answer);
        }
        Ok(answer)
    }

    /// Whether a request was made before, and is kept or being drawn.
    pub fn holds(&self, request: &Request) -> bool {
        self.state().entries.iter().any(|entry| entry.request == *request)
    }

    /// What is kept, or a claim to draw it; none where it is not to be kept.
    fn find(&self, request: Request, occasion: Occasion) -> Result<Arc<Answer>, Option<Claim<'_>>> {
        let mut state = self.state();
        while let Some(place) = state.entries.iter().rposition(|entry| entry.request == request) {
            if let Some(answer) = state.entries[place].answer.clone() {
                let entry = state.entries.remove(place);
                state.entries.push(Entry { asked_at: Instant::now(), ..entry });
                return Ok(answer);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if occasion == Occasion::Passing {
            return Err(None);
        }
        state.number += 1;
        let number = state.number;
        let bytes = LEAST_BYTES.max(request.bytes());
        state.entries.push(Entry { number, request, occasion, asked_at: Instant::now(), answer: None, bytes });
        Err(Some(Claim { pool: self, number }))
    }

    /// Keeps what was claimed, in place of what was not asked for the longest.
    fn keep(&self, number: u64, answer: &Arc<Answer>) {
        let mut state = self.state();
        let Some(entry) = state.entries.iter_mut().find(|entry| entry.number == number) else { return };
        let bytes = LEAST_BYTES.max(entry.request.bytes() + answer.bytes());
        let is_ahead = entry.occasion == Occasion::Ahead;
        if bytes > if is_ahead { self.caps.ahead_bytes } else { self.caps.bytes } {
            return;
        }
        (entry.bytes, entry.answer) = (bytes, Some(answer.clone()));
        // What was drawn ahead goes before what others begin with.
        let is_ahead = |entry: &Entry| entry.occasion == Occasion::Ahead;
        let left_bytes = self.caps.bytes.saturating_sub(state.bytes(|entry| !is_ahead(entry)));
        state.evict(self.caps.ahead_bytes.min(left_bytes), is_ahead);
        state.evict(self.caps.bytes, |_| true);
    }

    /// Gives back what nobody asked for until now for long; whether there was any.
    pub fn forget_unasked(&self, now: Instant) -> bool {
        let mut state = self.state();
        let before = state.entries.len();
        let is_asked = |entry: &Entry| now.saturating_duration_since(entry.asked_at) < self.caps.unasked;
        state.entries.retain(|entry| entry.answer.is_none() || is_asked(entry));
        state.entries.len() < before
    }

    /// Images that were drawn.
    pub fn drawn(&self) -> u64 {
        self.drawn.load(Ordering::Relaxed)
    }

    /// Images that were not drawn, as they were kept.
    pub fn shared(&self) -> u64 {
        self.shared.load(Ordering::Relaxed)
    }

    /// Looks that were not taken, as another client's did.
    pub fn looks_shared(&self) -> u64 {
        self.looks_shared.load(Ordering::Relaxed)
    }

    /// A past that no client had before.
    pub fn new_past(&self) -> Past {
        Past::Shared(self.pasts.fetch_add(1, Ordering::Relaxed))
    }

    /// Memory that is taken now.
    pub fn bytes(&self) -> usize {
        self.state().bytes(|_| true)
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::json!({ "drawn": self.drawn(), "shared": self.shared(), "looks_shared": self.looks_shared(), "bytes": self.bytes() })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Whatever is changed is whole at every moment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// What some entries take that are kept.
    fn bytes(&self, is_meant: impl Fn(&Entry) -> bool) -> usize {
        let kept = self.entries.iter().filter(|entry| entry.answer.is_some() && is_meant(entry));
        kept.map(|entry| entry.bytes).sum()
    }

    /// Forgets answers of some entries, those first that were not asked for the longest, until they take no more than `most_bytes`.
    fn evict(&mut self, most_bytes: usize, is_meant: impl Fn(&Entry) -> bool) {
        let mut bytes = self.bytes(&is_meant);
        self.entries.retain(|entry| {
            let goes = bytes > most_bytes && entry.answer.is_some() && is_meant(entry);
            bytes -= if goes { entry.bytes } else { 0 };
            !goes
        });
    }
}

#[cfg(test)]
mod tests;
