//! A relay: it passes on what a server's presenters are sent, to followers of its own, without a scene and without a GPU.
//!
//! Server and relays know nothing of each other but a broker ([`crate::broker`]). To its followers a relay is a server: it presents what it hears, in an audience
//! of its own, and from there on all is as where one server has both ends ([`crate::audience`]).
//!
//! - [`Relay`]: what all of it knows; `origin`: the server that is relayed; `feed`: one of its presenters; `hear`: what is asked and heard at the broker.
//! - `session`: one follower's connection; [`options`]: the command line.

mod feed;
mod figures;
mod hear;
pub mod options;
mod origin;
mod session;
mod state;

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::extract::ws::WebSocket;
use tokio::sync::{Notify, Semaphore, watch};
use tokio::task::JoinHandle;

use crate::app::{self, Answering, ServeError};
use crate::broker::Broker;
use crate::config::Config;
use crate::host::{Guest, Host, Session};
use crate::peers::Peers;
use crate::serving::DRAINING;
use crate::session::Over;
pub use state::{Heard, Relay};

/// How long sessions have to say goodbye when the relay stops.
const FAREWELL: Duration = Duration::from_secs(2);

/// A relay that runs in the background until it is stopped. Dropping it leaves it running.
pub struct Running {
    /// Where it listens.
    pub addr: SocketAddr,
    /// What its sessions share.
    pub relay: Arc<Relay>,
    url: String,
    stop: watch::Sender<bool>,
    tasks: [JoinHandle<()>; 2],
}

/// Relays what is published at a broker. Of a server's options those count that are about its port.
pub async fn serve(config: Config, broker: Broker) -> Result<Running, ServeError> {
    let relay = Arc::new(Relay {
        broker,
        limits: config.limits,
        stats: Arc::default(),
        heard: Heard::default(),
        origin: Mutex::default(),
        places: Arc::new(Semaphore::new(config.limits.clients)),
        asks: Notify::new(),
        over: watch::Sender::default(),
    });
    let Answering { addr, url, stop, task } = app::listen_for(&config, relay.clone()).await?;
    let hears = hears(&relay);
    Ok(Running { addr, relay, url, stop, tasks: [task, hears] })
}

/// No part of an asynchronous function, as `app::answers`.
fn hears(relay: &Arc<Relay>) -> JoinHandle<()> {
    tokio::spawn(hear::run(relay.clone()))
}

impl Running {
    /// Where a browser finds it.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Lets nobody in any more, which `/readyz` says, says goodbye to every client and stops.
    pub async fn stop(self) {
        self.relay.over.send_replace(Some(Over::Stops));
        let sessions = u32::try_from(self.relay.limits.clients).unwrap_or(u32::MAX);
        if tokio::time::timeout(FAREWELL, self.relay.places.acquire_many(sessions)).await.is_err() {
            tracing::warn!("some clients did not take the goodbye in time");
        }
        self.stop.send_replace(true);
        for task in self.tasks {
            if tokio::time::timeout(FAREWELL, task).await.is_err() {
                tracing::warn!("some requests did not end in time");
            }
        }
    }
}

impl Host for Relay {
    fn ready(&self) -> Result<(), String> {
        if self.over.borrow().is_some() {
            return Err(DRAINING.to_owned());
        }
        self.relayed().map(|_| ())
    }

    fn health(&self) -> Result<serde_json::Value, String> {
        Ok(figures::health(self))
    }

    fn metrics(&self, peers: &Peers) -> Result<String, String> {
        Ok(figures::metrics(self, peers))
    }

    fn plan(&self) -> Result<Option<serde_json::Value>, String> {
        Ok(None)
    }

    fn to_follow(&self) -> Vec<String> {
        self.relayed().map(|origin| origin.presenters()).unwrap_or_default()
    }

    fn run(self: Arc<Self>, socket: WebSocket, guest: Guest) -> Session {
        Box::pin(async move { session::run(&self, socket, guest).await })
    }
}
