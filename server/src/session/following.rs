//! A session that follows a presenter: it is sent what he is sent, has no copy of its own at the server, and takes no turns at the worker.

use std::convert::Infallible;
use std::sync::atomic::Ordering;

use futures_util::StreamExt;
use protocol::session::ServerEvent;
use protocol::wire::PackedUpdate;

use super::end::End;
use super::wall_clock::IDLE;
use super::{Connection, is_over};
use crate::audience::Following;

/// Between two places of the presenter's eye at least: clients go from one to the next by themselves.
const EYE_INTERVAL_S: f64 = 0.1;

impl Connection<'_> {
    /// Runs until the session ends.
    pub(super) async fn follow(&mut self, mut following: Following) -> Result<Infallible, End> {
        let shared = self.shared;
        let (mut next_eye_s, mut outgoing) = (0.0, None);
        loop {
            let now_s = shared.now_s();
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
            let wake = self.until(if now_s < next_eye_s { deadline_s.min(next_eye_s) } else { deadline_s }).min(IDLE);
            let outgoing_bytes = outgoing.as_ref().map_or(0, bytes::Bytes::len);
            tokio::select! {
                message = self.incoming.next() => self.receive(message)?,
                sent = self.outlet.send(&mut outgoing), if outgoing_bytes > 0 => {
                    sent?;
                    shared.house.stats.sent_bytes.fetch_add(outgoing_bytes as u64, Ordering::Relaxed);
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
}
