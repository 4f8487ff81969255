//! A session on real time: at most one turn at the worker at a time, at most one in an update interval, and none while the
//! client lacks nothing or has not acknowledged what it was sent.

use std::convert::Infallible;
use std::sync::PoisonError;

use futures_util::StreamExt;
use protocol::session::ServerEvent;
use protocol::wire;

use super::end::End;
use super::link::{IDLE, is_over};
use super::{Connection, Turn};
use crate::audience::Presenting;
use crate::fault::Fault;
use crate::viewer::Viewer;
use crate::worker::{NotServed, Served, Wish};

/// A session that lacked nothing in so many ticks one after the other, while its viewer stood, is asked at every message and at [`IDLE`] intervals: whoever stands costs next to nothing.
const QUIET_TICKS: u32 = 30;

/// Waits until somebody needs the whole copy of who presents.
async fn asked(presenting: Option<&Presenting>) {
    match presenting {
        Some(presenting) => presenting.asked().await,
        None => std::future::pending().await,
    }
}

impl<'a> Connection<'a> {
    /// Runs until the session ends.
    pub(super) async fn run_on_wall_clock(&mut self) -> Result<Infallible, End> {
        let shared = self.shared;
        let interval_s = shared.rules.update_interval_s;
        let (mut next_tick_s, mut outgoing) = (0.0, None);
        let mut quiet_ticks = 0_u32;
        loop {
            let now_s = shared.now_s();
            self.link.session.handle_timeout(now_s)?;
            while let Some(event) = self.link.session.poll_event() {
                quiet_ticks = 0;
                match event {
                    ServerEvent::Resume(held) => self.resume(held).await,
                    event => self.event(event)?,
                }
            }
            if let Some(following) = self.following.take() {
                return self.link.follow(following).await;
            }
            if self.turn.is_none() && now_s >= next_tick_s {
                self.put_before(now_s);
                next_tick_s = f64::max(next_tick_s + interval_s, now_s);
                self.turn = self.make_whole().or_else(|| self.wish(now_s).and_then(|wish| self.take_turn(wish)));
                quiet_ticks = if self.turn.is_none() { quiet_ticks.saturating_add(1) } else { 0 };
            }
            if outgoing.is_none() {
                outgoing = self.link.session.poll_transmit(now_s);
            }
            let is_waiting = self.turn.is_none() && quiet_ticks < QUIET_TICKS;
            let wake = if is_waiting { shared.clock.until(next_tick_s) } else { IDLE };
            let wake =
                self.link.session.next_deadline_s().map_or(wake, |deadline_s| wake.min(shared.clock.until(deadline_s)));
            let outgoing_bytes = outgoing.as_ref().map_or(0, bytes::Bytes::len);
            tokio::select! {
                message = self.link.incoming.next() => self.link.receive(message)?,
                sent = self.link.outlet.send(&mut outgoing), if outgoing_bytes > 0 => {
                    sent?;
                    self.link.sent(outgoing_bytes);
                }
                served = async { self.turn.as_mut().expect("polled only while there is one").await }, if self.turn.is_some() => {
                    self.turn = None;
                    self.served(served?, shared.now_s());
                }
                () = asked(self.presenting.as_deref()), if self.turn.is_none() => {}
                () = tokio::time::sleep(wake) => {}
                Ok(gives) = &mut self.give_way => return Err(End::Resumed(gives)),
                over = is_over(&mut self.link.over) => return Err(over.into()),
            }
        }
    }

    /// Queues for a turn, which will look at the newest pose when it comes.
    fn take_turn(&mut self, wish: Wish) -> Option<Turn<'a>> {
        let (shared, viewer) = (self.shared, self.viewer.clone());
        let clock = shared.clock;
        let look = Box::new(move || -> (Viewer, f64) {
            let viewer = *viewer.lock().unwrap_or_else(PoisonError::into_inner);
            (viewer, clock.now_s())
        });
        let client = self.client.take()?;
        Some(Box::pin(shared.worker.serve(client, wish, look)))
    }

    /// Makes the whole copy where followers ask for it.
    fn make_whole(&mut self) -> Option<Turn<'a>> {
        let presenting = self.presenting.clone().filter(|presenting| presenting.is_asked())?;
        // A presenter who took an audience over has nothing to pass on before his first update.
        let client = self.client.take_if(|client| client.account.held().lighting.is_some())?;
        let (shared, coding) = (self.shared, self.shared.config.coding.coding(None));
        Some(Box::pin(async move {
            // As long as encoding any update: other sessions' tasks go on.
            let made = tokio::task::spawn_blocking(move || {
                let whole = wire::encode_update(&client.account.held().whole(), coding);
                (client, whole)
            });
            let (client, whole) = made.await.map_err(|error| {
                let fault = Fault::of_task(error);
                shared.house.stats.count_fault(&fault);
                NotServed::Fault(fault)
            })?;
            presenting.publish_whole(whole.packed(shared.now_s()));
            Ok(Served { client, update: None })
        }))
    }
}
