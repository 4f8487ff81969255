//! One line of the log for each session, when it has ended: who was there, from where, when, how long and by what right, why it ended, and how much went over.
//!
//! Lines have the target [`TARGET`], so that they can be told from others and kept elsewhere. None holds a token, or a secret by which a client comes back.

use std::net::SocketAddr;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use protocol::message::Role;
use protocol::session::ServerSession;

/// Of the lines.
pub const TARGET: &str = "audit";

/// What is noted of a session from its beginning on.
pub struct Audit {
    /// Handed to it.
    pub updates: u64,
    /// Whether it went on with an earlier one.
    pub resumed: bool,
    by_token: bool,
    origin: Option<String>,
    began: SystemTime,
    begun: Instant,
}

impl Audit {
    pub fn begin(by_token: bool, origin: Option<String>) -> Audit {
        Audit { updates: 0, resumed: false, by_token, origin, began: SystemTime::now(), begun: Instant::now() }
    }

    /// Writes the line.
    pub fn end(&self, (number, peer): (u64, SocketAddr), session: &ServerSession, why: &str) {
        let (bytes_in, bytes_out) = session.bytes_received_and_sent();
        let began_unix_s = self.began.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        let role = match session.role() {
            _ if session.view().is_none() => "nobody",
            Role::Viewer => "viewer",
            Role::Presenter(_) => "presenter",
            Role::Follower(_) => "follower",
            Role::Camera(_) => "camera",
        };
        tracing::info!(
            target: TARGET,
            session = number, %peer, role, by_token = self.by_token, origin = self.origin.as_deref().unwrap_or(""),
            began_unix_s, seconds = self.begun.elapsed().as_secs_f64(), why, bytes_in, bytes_out,
            updates = self.updates, resumed = self.resumed, "session ended"
        );
    }
}
