//! A session on virtual time: its own clock advances only when the client says so, and rendering and coding take none of
//! it. The same messages give the same bytes on every machine.

use std::convert::Infallible;

use futures_util::StreamExt;
use protocol::session::ServerEvent;

use super::Connection;
use super::end::End;
use super::link::{LINGER, is_over};

/// Ticks that one step may take at most, in seconds of them: the longest step a session accepts.
const MAX_STEP_S: f64 = 60.0;

impl Connection<'_> {
    /// Runs until the session ends.
    pub(super) async fn run_on_virtual_clock(&mut self) -> Result<Infallible, End> {
        let mut next_tick = 0;
        loop {
            self.transmit().await?;
            while let Some(event) = self.link.session.poll_event() {
                match event {
                    ServerEvent::Advance { to_s } => self.advance(&mut next_tick, to_s).await?,
                    event => self.event(event)?,
                }
            }
            self.transmit().await?;
            let deadline_s = self.link.session.next_deadline_s().unwrap_or(f64::INFINITY) - self.shared.now_s();
            let wake = std::time::Duration::try_from_secs_f64(deadline_s.max(0.0)).unwrap_or(LINGER);
            tokio::select! {
                message = self.link.incoming.next() => self.link.receive(message)?,
                () = tokio::time::sleep(wake) => self.link.session.handle_timeout(self.shared.now_s())?,
                over = is_over(&mut self.link.over) => return Err(over.into()),
            }
        }
    }

    /// Runs every tick up to `to_s`, each with what was delivered by then.
    async fn advance(&mut self, next_tick: &mut i64, to_s: f64) -> Result<(), End> {
        let hz = self.shared.config.update_hz;
        let last_tick = (to_s * hz).floor() as i64;
        // A client whose time begins late does not make up for all the ticks before.
        *next_tick = (*next_tick).max(last_tick.saturating_sub((MAX_STEP_S * hz).ceil() as i64));
        while *next_tick <= last_tick {
            self.tick(*next_tick as f64 / hz).await?;
            *next_tick += 1;
        }
        self.run_until(to_s)?;
        self.link.session.advanced();
        Ok(())
    }

    async fn tick(&mut self, tick_s: f64) -> Result<(), End> {
        self.run_until(tick_s)?;
        self.put_before(tick_s);
        if let Some(wish) = self.wish(tick_s)
            && let Some(client) = self.client.take()
        {
            let viewer = self.viewer();
            let served = self.shared.worker.serve(client, wish, Box::new(move || (viewer, tick_s))).await?;
            self.served(served, tick_s);
        }
        self.transmit().await
    }

    /// Takes in what is stamped up to `until_s`.
    fn run_until(&mut self, until_s: f64) -> Result<(), End> {
        self.link.session.run_until(until_s)?;
        while let Some(event) = self.link.session.poll_event() {
            self.event(event)?;
        }
        Ok(())
    }

    /// Hands everything to the socket; the client reads while it waits for the end of the step.
    async fn transmit(&mut self) -> Result<(), End> {
        while let Some(bytes) = self.link.session.poll_transmit(self.shared.now_s()) {
            self.link.sent(bytes.len());
            let mut bytes = Some(bytes);
            tokio::select! {
                sent = self.link.outlet.send(&mut bytes) => sent?,
                over = is_over(&mut self.link.over) => return Err(over.into()),
            }
        }
        Ok(())
    }
}
