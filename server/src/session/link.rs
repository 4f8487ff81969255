//! What any session has, whoever looks for its client: the socket, the sans-IO session, and what is told at the end. And all that a session needs that
//! follows a presenter: it is sent what he is sent, has no copy of its own at the server, and takes no turns at the worker.

use std::convert::Infallible;
use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, WebSocket, close_code};
use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::SplitStream;
use protocol::message::ServerMessage;
use protocol::session::{ServerConfig, ServerEvent, ServerSession, SessionError};
use protocol::wire::{self, Envelope, PackedUpdate};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, watch};

use super::audit::Audit;
use super::end::{End, Over};
use super::outlet::Outlet;
use crate::audience::Following;
use crate::fault;
use crate::host::Guest;
use crate::peers::{Doorstep, Place};
use crate::stats::Stats;

/// A session that waits for nothing else looks at its deadlines this often.
pub const IDLE: Duration = Duration::from_secs(1);
/// How long a connection stays open after the goodbye, so that it arrives before the reset that unread bytes may cause.
pub const LINGER: Duration = Duration::from_millis(250);
/// Between two places of the presenter's eye at least: clients go from one to the next by themselves.
pub const EYE_INTERVAL_S: f64 = 0.1;

/// The time that sessions are stamped by, in seconds.
#[derive(Debug, Clone, Copy)]
pub struct SessionClock {
    since: Instant,
    at_s: f64,
}

impl SessionClock {
    /// It is `at_s` now.
    pub fn at(at_s: f64) -> SessionClock {
        SessionClock { since: Instant::now(), at_s }
    }

    /// What time it is.
    pub fn now_s(&self) -> f64 {
        self.at_s + self.since.elapsed().as_secs_f64()
    }

    /// How long it is until a time.
    pub fn until(&self, at_s: f64) -> Duration {
        Duration::try_from_secs_f64((at_s - self.now_s()).max(0.0)).unwrap_or(IDLE)
    }
}

/// Waits until all sessions of what is shown are over.
pub async fn is_over(over: &mut watch::Receiver<Option<Over>>) -> Over {
    if let Ok(over) = over.wait_for(Option::is_some).await
        && let Some(over) = *over
    {
        return over;
    }
    std::future::pending().await
}

/// Says why a client may not stay, and closes. `again`: whether it may be otherwise when it comes again.
pub async fn refuse(socket: WebSocket, why: &str, again: bool) {
    let goodbye = ServerMessage::Goodbye { reason: why.to_owned(), again };
    let message = wire::encode_server(&Envelope { at_s: 0.0, message: goodbye }).into_iter().next();
    let (outgoing, _) = socket.split();
    Outlet::start(outgoing, LINGER).close(message, LINGER).await;
}

/// Counts a session as long as it is there, however it ends.
pub struct Counted<'a> {
    /// Among all sessions since the program started.
    pub number: u64,
    stats: &'a Stats,
    ended: &'a Notify,
}

impl<'a> Counted<'a> {
    /// One more. `ended` is told when it is there no more.
    pub fn new(stats: &'a Stats, ended: &'a Notify) -> Counted<'a> {
        stats.clients.fetch_add(1, Ordering::Relaxed);
        let number = 1 + stats.connected.fetch_add(1, Ordering::Relaxed);
        Counted { number, stats, ended }
    }
}

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.stats.clients.fetch_sub(1, Ordering::Relaxed);
        self.ended.notify_one();
    }
}

/// Why a session ended, and be it by a panic.
pub async fn ended(running: impl Future<Output = Result<Infallible, End>>, stats: &Stats) -> End {
    match fault::caught_in(running).await {
        Ok(Err(end)) => end,
        Err(fault) => {
            stats.count_fault(&fault);
            End::Fault
        }
    }
}

/// See the module.
pub struct Link<'a> {
    /// Of the session, among all since the program started.
    pub number: u64,
    /// Who it is.
    pub peer: SocketAddr,
    /// Its state.
    pub session: ServerSession,
    /// What it says.
    pub incoming: SplitStream<WebSocket>,
    /// What is said to it.
    pub outlet: Outlet,
    /// Whether all sessions are over.
    pub over: watch::Receiver<Option<Over>>,
    /// What is noted of it.
    pub audit: Audit,
    /// One of the places for sessions, from when the client has greeted on.
    pub place: Option<OwnedSemaphorePermit>,
    /// Until then.
    doorstep: Option<Doorstep>,
    /// Among those of the client's address, where it comes by way of a proxy.
    _place_of_address: Place,
    clock: SessionClock,
    /// How long its client need not read.
    patience: Duration,
    stats: &'a Stats,
}

impl<'a> Link<'a> {
    /// Waits for a client's greeting.
    pub fn new(
        socket: WebSocket,
        (number, guest): (u64, Guest),
        config: ServerConfig,
        (clock, patience): (SessionClock, Duration),
        over: watch::Receiver<Option<Over>>,
        stats: &'a Stats,
    ) -> Link<'a> {
        let (outgoing, incoming) = socket.split();
        let session = ServerSession::new(config, clock.now_s());
        let Guest { peer, doorstep, place, by_token, origin, .. } = guest;
        tracing::info!(%peer, "connected");
        Link {
            number,
            peer,
            session,
            incoming,
            outlet: Outlet::start(outgoing, patience),
            over,
            audit: Audit::begin(by_token, origin),
            place: None,
            doorstep: Some(doorstep),
            _place_of_address: place,
            clock,
            patience,
            stats,
        }
    }

    /// Takes one of the places for sessions, of which there are so many, and leaves the door to others.
    pub fn take_place(&mut self, places: &Arc<Semaphore>, most: usize) -> Result<(), End> {
        let full = End::Full { clients: most };
        self.place = Some(places.clone().try_acquire_owned().map_err(|_| full)?);
        self.doorstep = None;
        Ok(())
    }

    /// Takes in what came from the socket.
    pub fn receive(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), End> {
        match message {
            Some(Ok(Message::Close(Some(frame)))) if matches!(frame.code, close_code::NORMAL | close_code::AWAY) => {
                Err(End::Left)
            }
            None | Some(Ok(Message::Close(_))) => Err(End::Closed),
            Some(Err(error)) => Err(End::of_socket_error(error)),
            Some(Ok(Message::Binary(bytes))) => Ok(self.session.handle(&bytes, self.clock.now_s())?),
            Some(Ok(Message::Text(_))) => Err(SessionError::Unexpected("a text message").into()),
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(()),
        }
    }

    /// Counts what was handed to the socket.
    pub fn sent(&self, bytes: usize) {
        self.stats.sent_bytes.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Counts an update that was handed over.
    pub fn count_update(&mut self) {
        self.stats.updates.fetch_add(1, Ordering::Relaxed);
        self.audit.updates += 1;
    }

    /// Follows until the session ends.
    pub async fn follow(&mut self, mut following: Following) -> Result<Infallible, End> {
        let (mut next_eye_s, mut outgoing) = (0.0, None);
        loop {
            let now_s = self.clock.now_s();
            self.session.handle_timeout(now_s)?;
            while let Some(event) = self.session.poll_event() {
                // Where it looks from, and what it draws, changes nothing of what it is sent.
                if event == ServerEvent::Restart {
                    tracing::info!(peer = %self.peer, "the follower's copy is broken: it gets the whole one");
                    following.begin_anew();
                }
            }
            if self.session.can_send_update()
                && let Some(update) = following.next_update()
            {
                self.pass_on(&update, now_s)?;
            }
            if now_s >= next_eye_s
                && let Some(messages) = following.eye()
            {
                self.session.say_packed(&messages);
                next_eye_s = now_s + EYE_INTERVAL_S;
            }
            if outgoing.is_none() {
                outgoing = self.session.poll_transmit(now_s);
            }
            let deadline_s = self.session.next_deadline_s().unwrap_or(f64::INFINITY);
            let wake_s = if now_s < next_eye_s { deadline_s.min(next_eye_s) } else { deadline_s };
            let wake = self.clock.until(wake_s).min(IDLE);
            let outgoing_bytes = outgoing.as_ref().map_or(0, Bytes::len);
            tokio::select! {
                message = self.incoming.next() => self.receive(message)?,
                sent = self.outlet.send(&mut outgoing), if outgoing_bytes > 0 => {
                    sent?;
                    self.sent(outgoing_bytes);
                }
                () = following.changed() => {}
                () = tokio::time::sleep(wake) => {}
                over = is_over(&mut self.over) => return Err(over.into()),
            }
        }
    }

    /// Sends what the presenter was sent.
    fn pass_on(&mut self, update: &PackedUpdate, now_s: f64) -> Result<(), End> {
        self.session.send_packed(update, now_s).map_err(|error| End::CannotFollow(error.to_string()))?;
        self.count_update();
        Ok(())
    }

    /// Says why it ends, in the log and to the client.
    pub async fn farewell(mut self, end: End) {
        let (peer, reason) = (self.peer, end.words(self.patience));
        self.audit.end((self.number, peer), &self.session, reason.as_deref().unwrap_or("left"));
        let Some(reason) = reason else { return };
        if matches!(end, End::Malformed(_) | End::Session(_) | End::NotReading) {
            self.stats.cut_off.fetch_add(1, Ordering::Relaxed);
            tracing::warn!(%peer, "cut off: {reason}");
        }
        let now_s = self.clock.now_s();
        self.session.close(&reason, end.may_change(), now_s);
        // The goodbye is the last message; what a virtual session still had to say before it is for nobody.
        let mut last = None;
        while let Some(bytes) = self.session.poll_transmit(now_s) {
            last = Some(bytes);
        }
        self.outlet.close(last, LINGER).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_fault_is_counted_and_ends_a_session_as_any_other_reason_does() {
        let (stats, over) = (Stats::default(), Notify::new());
        let counted = Counted::new(&stats, &over);
        assert_eq!(counted.number, 1);
        let end = ended(async { panic!("a mistake") }, &stats).await;
        assert!(matches!(end, End::Fault), "{end:?}");
        assert_eq!(stats.faults.load(Ordering::Relaxed), 1);
        assert!(matches!(ended(async { Err(End::Left) }, &stats).await, End::Left));
        assert_eq!((stats.faults.load(Ordering::Relaxed), stats.clients.load(Ordering::Relaxed)), (1, 1));
        drop(counted);
        assert_eq!(stats.clients.load(Ordering::Relaxed), 0);
        over.notified().await;
    }
}
