//! One presenter of the server that is relayed, as his followers here get him.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use async_nats::{Client, Message};
use futures_util::StreamExt;
use protocol::wire::PackedUpdate;
use tokio::task::AbortHandle;

use super::origin::Origin;
use super::state::Relay;
use crate::audience::Presenting;
use crate::broker::Kind;
use crate::broker::pieces::{Gather, PieceError, eye, opened};

/// An update is this much newer than what the server said last at most: some seconds of any rate. What is further ahead would hold up all that follows.
const MOST_AHEAD: u64 = 10_000;

/// The rest of a whole copy that is not heard on for so long never comes.
const WHOLE_COMES_FOR: Duration = Duration::from_secs(2);

/// When a part of a whole copy came that is not complete yet.
type WholeComes = Arc<Mutex<Option<Instant>>>;

/// See the module. Dropping it ends it.
pub(super) struct Feed {
    presenting: Arc<Presenting>,
    whole_comes: WholeComes,
    task: AbortHandle,
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Feed {
    /// Listens to a presenter; `None` where that is done already.
    pub fn start(relay: &Arc<Relay>, origin: &Arc<Origin>, client: &Client, name: &str) -> Option<Feed> {
        let presenting = Arc::new(origin.audiences.present(name)?);
        let whole_comes = WholeComes::default();
        let (relay, client, subject) = (relay.clone(), client.clone(), relay.broker.subjects().all_of(name));
        let mut listener = Listener {
            relay,
            origin: origin.clone(),
            name: name.to_owned(),
            presenting: presenting.clone(),
            whole_comes: whole_comes.clone(),
            updates: Gather::default(),
            whole: Gather::default(),
            last: None,
        };
        let task = tokio::spawn(async move { listener.listen(client, subject).await }).abort_handle();
        Some(Feed { presenting, whole_comes, task })
    }

    /// Whether it listens no more, which it does by itself only where it met a fault or the connection was given up.
    pub fn has_ended(&self) -> bool {
        self.task.is_finished()
    }

    /// Whether the whole copy is to be asked for.
    pub fn needs_whole(&self) -> bool {
        let comes = *self.whole_comes.lock().unwrap_or_else(PoisonError::into_inner);
        self.presenting.is_asked() && comes.is_none_or(|at| at.elapsed() > WHOLE_COMES_FOR)
    }

    /// The server had sent this update half a second ago.
    pub fn should_hold(&self, number: u64) {
        if self.presenting.last() < number {
            self.presenting.ask_whole();
        }
    }
}

struct Listener {
    relay: Arc<Relay>,
    origin: Arc<Origin>,
    name: String,
    presenting: Arc<Presenting>,
    whole_comes: WholeComes,
    updates: Gather,
    whole: Gather,
    /// The newest update that was passed on.
    last: Option<u64>,
}

impl Listener {
    async fn listen(&mut self, client: Client, subject: String) {
        let mut messages = match client.subscribe(subject).await {
            Ok(messages) => messages,
            Err(error) => return tracing::error!(name = self.name, "cannot listen: {error}"),
        };
        // What is asked for after this is heard.
        self.presenting.ask_whole();
        self.relay.asks.notify_one();
        loop {
            tokio::select! {
                message = messages.next() => match message {
                    Some(message) => self.hear(message),
                    None => return,
                },
                () = self.presenting.asked() => self.relay.asks.notify_one(),
            }
        }
    }

    fn hear(&mut self, message: Message) {
        self.relay.heard.bytes.fetch_add(message.payload.len() as u64, Ordering::Relaxed);
        if let Err(error) = self.take(message) {
            self.relay.heard.refused.fetch_add(1, Ordering::Relaxed);
            tracing::debug!(name = self.name, "a message that makes no sense: {error}");
        }
    }

    fn take(&mut self, Message { subject, payload, .. }: Message) -> Result<(), PieceError> {
        let (origin, message) = opened(payload).ok_or(PieceError::Wrong("no piece"))?;
        if origin != self.origin.id() {
            return Err(PieceError::Wrong("of another run of the server"));
        }
        match Kind::of(&subject) {
            Some(Kind::Updates) => self.updates.push(message)?.map_or(Ok(()), |update| self.pass_on(update)),
            Some(Kind::Whole) => {
                let came = self.whole.push(message);
                let comes = self.whole.is_under_way().then(Instant::now);
                *self.whole_comes.lock().unwrap_or_else(PoisonError::into_inner) = comes;
                came?.map_or(Ok(()), |whole| self.pass_on_whole(whole))
            }
            Some(Kind::Eye) => {
                let (world_from_eye, playback, at_s) = eye(&message)?;
                self.presenting.look_from(world_from_eye, playback, at_s);
                Ok(())
            }
            None => Err(PieceError::Wrong("of no kind")),
        }
    }

    fn pass_on(&mut self, update: PackedUpdate) -> Result<(), PieceError> {
        self.check(&update)?;
        let last = self.presenting.last();
        // Who fell behind and was given a whole copy has had it.
        if self.last.is_some() && update.number <= last {
            return Ok(());
        }
        let heard = &self.relay.heard;
        heard.updates.fetch_add(1, Ordering::Relaxed);
        if self.last.is_some() && update.number != last + 1 && !update.clears {
            heard.gaps.fetch_add(1, Ordering::Relaxed);
        }
        self.last = Some(update.number);
        self.presenting.publish(update);
        Ok(())
    }

    fn pass_on_whole(&mut self, whole: PackedUpdate) -> Result<(), PieceError> {
        self.check(&whole)?;
        if !whole.clears {
            return Err(PieceError::Wrong("no whole copy"));
        }
        self.relay.heard.wholes.fetch_add(1, Ordering::Relaxed);
        self.last = self.last.max(Some(whole.number));
        self.presenting.publish_whole(whole);
        Ok(())
    }

    fn check(&self, update: &PackedUpdate) -> Result<(), PieceError> {
        let newest = self.origin.newest(&self.name).unwrap_or(self.presenting.last());
        let is_near = update.number <= newest.saturating_add(MOST_AHEAD) && update.number > 0;
        if is_near { Ok(()) } else { Err(PieceError::Wrong("an update of some other time")) }
    }
}
