//! The state machines of both ends, without any I/O (as quinn-proto does it): received messages and the time go in; messages
//! to send, events and the next deadline come out. The socket is a thin loop around [`ClientSession`] or [`ServerSession`],
//! and a test runs both ends on virtual time.
//!
//! ```text
//! client                               server
//! Hello                         ->     checked; refused by Goodbye{reason, again}
//!                               <-     Welcome
//! Pose, View (when they change) ->     the newest one counts
//!                               <-     Update 1, 2, 3 ... in fragments, while credit lasts
//! Ack{number, digest, bytes}    ->     credit; a wrong digest begins anew
//! Restart (copy broken)         ->     begins anew: the next update starts with Edit::Clear
//! Ping (2 s, at rest 5 s)       ->
//!                               <-     Pong
//! ```
//!
//! **Client**: *greeting* (Hello sent) until Welcome comes, then *open*; *closed* after any error or Goodbye, when only what is
//! queued may still be sent. While its copy is *broken* it drops updates until one begins with [`Edit::Clear`]. Bulk is not
//! decoded here: [`ClientEvent::Update`] gives its bytes, for [`decode_update`] and [`Held::apply`] on whatever thread;
//! then [`ClientSession::applied`] acknowledges it, or [`ClientSession::broken`] asks to begin anew.
//!
//! **Server**: *greeting* until Hello comes, *resuming* while it is looked for what a client that comes back was sent, then *open*; *closed* after any error, with a Goodbye queued that says why.
//! [`ServerSession::can_send_update`] holds back while more than the path's bandwidth-delay product is not yet acknowledged,
//! or while the socket has not yet taken the last update: what is not sent yet can still be replaced by something newer.
//!
//! **Coming back**: Welcome has a secret. A client whose connection was cut off says it in its next Hello, with the number and digest of the last update that it
//! holds. [`ServerEvent::Resume`] asks for what the server kept of that session, [`ServerSession::resume`] answers: Welcome says whether updates build on what the
//! client holds, and those that were on their way are sent again.
//!
//! **Virtual clock** ([`Clock::Virtual`]): sockets are real, time is in the envelopes. The client stamps a message with the time
//! at which its emulated network delivers it ([`ClientSession::poll_transmit_stamped`]), then says `Advance{to_s}`. The server
//! runs each tick `T <= to_s` in order: [`ServerSession::run_until`]`(T)` takes in what is stamped `<= T`, updates are sent
//! with stamp `T`, and `Advanced{to_s}` ends the step. The client computes when each message arrives
//! ([`ClientSession::receive_virtual`]) and takes it in at that time ([`ClientSession::run_until`]). Hello, Welcome,
//! Advance and Advanced take no time: they set up and pace the run. Nothing depends on how fast a machine is.
//!
//! [`Edit::Clear`]: crate::Edit::Clear
//! [`decode_update`]: crate::wire::decode_update
//! [`Held::apply`]: crate::Held::apply
//! [`Clock::Virtual`]: crate::message::Clock::Virtual

mod client;
mod flow;
mod rate;
mod scene_clock;
mod server;
mod trail;

pub use client::{ClientConfig, ClientEvent, ClientSession, DEFAULT_BUDGET_BYTES, ReceivedUpdate};
pub use rate::TokenBucket;
pub use scene_clock::SceneClock;
pub use server::{ClientPose, SendError, ServerConfig, ServerEvent, ServerSession};
pub use trail::Trail;

use thiserror::Error;

use crate::message::Clock;
use crate::wire::WireError;

/// What a presenter's copy may take, and a follower must have room for, in bytes: three million samples, as browsers give to a page.
pub const AUDIENCE_BUDGET_BYTES: u64 = 256 << 20;

/// Whose fault the end of a session is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The other end broke the protocol.
    Peer,
    /// The path, or the other end vanished.
    Network,
    /// Both ends are sound but do not fit together.
    Mismatch,
}

/// Why a session ended.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// A message was malformed or too large.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// The ends speak different versions.
    #[error("the other end speaks version {theirs} of the protocol, this one version {ours}")]
    Version {
        /// This end's.
        ours: u16,
        /// The other end's.
        theirs: u16,
    },
    /// The server does not run the clock that the client asked for.
    #[error("the server runs on the {server:?} clock, the client asked for {client:?}")]
    Clock {
        /// What the server runs.
        server: Clock,
        /// What the client asked for.
        client: Clock,
    },
    /// The client asked for a camera that the server does not have.
    #[error("there is no camera {asked:?}; the server has: {}", if known.is_empty() { "none" } else { known })]
    Camera {
        /// The name that was asked for.
        asked: String,
        /// The names that there are.
        known: String,
    },
    /// Two clients cannot present under one name.
    #[error("{name:?} presents already")]
    Presented {
        /// The name.
        name: String,
    },
    /// A follower holds what his presenter holds.
    #[error("who follows needs {mib} MiB for what is presented")]
    NoRoom {
        /// How much.
        mib: u64,
    },
    /// A message that its sender may not send now.
    #[error("unexpected: {0}")]
    Unexpected(&'static str),
    /// A value out of its range.
    #[error("out of range: {0}")]
    Range(&'static str),
    /// More messages than allowed.
    #[error("too many {0}")]
    TooMany(&'static str),
    /// The client did not greet in time.
    #[error("no greeting within {after_s} s")]
    NoGreeting {
        /// Seconds waited.
        after_s: f64,
    },
    /// Nothing was heard for too long.
    #[error("nothing heard for {after_s} s")]
    Silent {
        /// Seconds waited.
        after_s: f64,
    },
    /// The client neither takes nor acknowledges what is sent to it.
    #[error("nothing taken or acknowledged for {after_s} s")]
    Stalled {
        /// Seconds waited.
        after_s: f64,
    },
    /// The server said goodbye.
    #[error("the server hung up: {reason}")]
    Goodbye {
        /// As the server puts it.
        reason: String,
        /// Whether it may be otherwise for who comes again just as it did.
        again: bool,
    },
    /// This session ended before.
    #[error("the session has ended")]
    Closed,
}

impl SessionError {
    /// Whether it may go well for a client that comes again just as it did.
    pub fn may_come_again(&self) -> bool {
        !matches!(
            self,
            SessionError::Version { .. }
                | SessionError::Clock { .. }
                | SessionError::Camera { .. }
                | SessionError::NoRoom { .. }
                | SessionError::Goodbye { again: false, .. }
        )
    }

    /// Whose fault it is.
    pub fn fault(&self) -> Fault {
        match self {
            SessionError::Wire(_)
            | SessionError::Unexpected(_)
            | SessionError::Range(_)
            | SessionError::TooMany(_)
            | SessionError::NoGreeting { .. } => Fault::Peer,
            SessionError::Version { .. }
            | SessionError::Clock { .. }
            | SessionError::Camera { .. }
            | SessionError::Presented { .. }
            | SessionError::NoRoom { .. }
            | SessionError::Goodbye { .. } => Fault::Mismatch,
            SessionError::Silent { .. } | SessionError::Stalled { .. } | SessionError::Closed => Fault::Network,
        }
    }
}
