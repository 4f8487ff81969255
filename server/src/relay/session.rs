//! One client's connection at a relay: a follower, or somebody who is told that one can only follow here.

use std::convert::Infallible;
use std::panic::AssertUnwindSafe;
use std::sync::atomic::Ordering;

use axum::extract::ws::WebSocket;
use futures_util::{FutureExt, StreamExt};
use protocol::message::{Clock, Role, Welcome};
use protocol::session::{ServerConfig, ServerEvent};

use super::origin::Origin;
use super::state::Relay;
use crate::fault::Fault;
use crate::peers::Doorstep;
use crate::session::Over;
use crate::session::audit::Audit;
use crate::session::end::End;
use crate::session::link::{Guest, IDLE, Link, is_over, refuse};

/// Counts a session as long as it is there, however it ends.
struct Counted<'a>(&'a Relay);

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.0.stats.clients.fetch_sub(1, Ordering::Relaxed);
        self.0.asks.notify_one();
    }
}

/// Runs a session until it ends. A fault of its own ends it, and nothing else.
pub(super) async fn run(relay: &Relay, socket: WebSocket, guest: Guest) {
    relay.stats.clients.fetch_add(1, Ordering::Relaxed);
    let number = relay.stats.connected.fetch_add(1, Ordering::Relaxed) + 1;
    let _counted = Counted(relay);
    let origin = match relay.relayed() {
        Ok(origin) => origin,
        Err(why) => return refuse(socket, &why, true).await,
    };
    let Guest { peer, doorstep, place: _place_of_address, by_token, origin: page } = guest;
    let (limits, clock) = (&relay.limits, origin.clock);
    let welcome = Welcome { scene_time_s: clock.now_s(), ..origin.welcome.clone() };
    let config = ServerConfig {
        greeting_s: limits.hello.as_secs_f64(),
        silence_s: limits.silence.as_secs_f64(),
        stall_s: limits.stall.as_secs_f64(),
        ..ServerConfig::new(Clock::Wall, welcome)
    };
    let (over, audit) = (relay.over.subscribe(), Audit::begin(by_token, page));
    let mut link = Link::new(socket, (number, peer), config, (clock, limits.stall), (over, audit), &relay.stats);
    tracing::info!(%peer, "connected");
    let following = AssertUnwindSafe(async {
        tokio::select! {
            ended = follow(relay, &origin, &mut link, doorstep) => ended,
            () = origin.replaced() => Err(End::Over(Over::Replaced)),
        }
    });
    let end = match following.catch_unwind().await {
        Ok(Err(end)) => end,
        Err(panic) => {
            relay.stats.count_fault(&Fault::of(&*panic));
            End::Fault
        }
    };
    link.farewell(end).await;
}

async fn follow(relay: &Relay, origin: &Origin, link: &mut Link<'_>, doorstep: Doorstep) -> Result<Infallible, End> {
    greet(origin, link).await?;
    let Role::Follower(name) = link.session.role() else {
        return Err(End::OnlyRelayed { presenters: origin.presenters() });
    };
    let full = End::Full { clients: relay.limits.clients };
    let _place = relay.places.clone().try_acquire_owned().map_err(|_| full)?;
    drop(doorstep);
    tracing::info!(peer = %link.peer, "follows {name:?}");
    let following = origin.audiences.follow(name);
    relay.asks.notify_one();
    link.follow(following).await
}

/// Waits until the client has greeted.
async fn greet(origin: &Origin, link: &mut Link<'_>) -> Result<(), End> {
    loop {
        let now_s = origin.clock.now_s();
        link.session.handle_timeout(now_s)?;
        // Who comes back held what another kind of session sent.
        if matches!(link.session.poll_event(), Some(ServerEvent::Opened | ServerEvent::Resume(_))) {
            return Ok(());
        }
        let wake = link.session.next_deadline_s().map_or(IDLE, |deadline_s| origin.clock.until(deadline_s).min(IDLE));
        tokio::select! {
            message = link.incoming.next() => link.receive(message)?,
            () = tokio::time::sleep(wake) => {}
            over = is_over(&mut link.over) => return Err(over.into()),
        }
    }
}
