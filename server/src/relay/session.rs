//! One client's connection at a relay: a follower, or somebody who is told that one can only follow here.

use std::convert::Infallible;

use axum::extract::ws::WebSocket;
use futures_util::StreamExt;
use protocol::message::{Clock, Role, Welcome};
use protocol::session::{ServerConfig, ServerEvent};

use super::origin::Origin;
use super::state::Relay;
use crate::host::Guest;
use crate::session::Over;
use crate::session::end::End;
use crate::session::link::{Counted, IDLE, Link, ended, is_over, refuse};

/// Runs a session until it ends. A fault of its own ends it, and nothing else.
pub(super) async fn run(relay: &Relay, socket: WebSocket, guest: Guest) {
    // Who leaves may have been the last one to follow somebody.
    let counted = Counted::new(&relay.stats, &relay.asks);
    let origin = match relay.relayed() {
        Ok(origin) => origin,
        Err(why) => return refuse(socket, &why, true).await,
    };
    let (limits, clock) = (&relay.limits, origin.clock);
    let welcome = Welcome { scene_time_s: clock.now_s(), ..origin.welcome.clone() };
    let config = ServerConfig {
        greeting_s: limits.hello.as_secs_f64(),
        silence_s: limits.silence.as_secs_f64(),
        stall_s: limits.stall.as_secs_f64(),
        ..ServerConfig::new(Clock::Wall, welcome)
    };
    let terms = (clock, limits.stall);
    let mut link = Link::new(socket, (counted.number, guest), config, terms, relay.over.subscribe(), &relay.stats);
    let following = async {
        tokio::select! {
            ended = follow(relay, &origin, &mut link) => ended,
            () = origin.replaced() => Err(End::Over(Over::Replaced)),
        }
    };
    let end = ended(following, &relay.stats).await;
    link.farewell(end).await;
}

async fn follow(relay: &Relay, origin: &Origin, link: &mut Link<'_>) -> Result<Infallible, End> {
    greet(origin, link).await?;
    let Role::Follower(name) = link.session.role().clone() else {
        return Err(End::OnlyRelayed { presenters: origin.presenters() });
    };
    link.take_place(&relay.places, relay.limits.clients)?;
    tracing::info!(peer = %link.peer, "follows {name:?}");
    let following = origin.audiences.follow(&name);
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
