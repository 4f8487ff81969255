//! What is there behind a port: a server with its scene, or a relay.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use axum::extract::ws::WebSocket;

use crate::peers::Peers;
use crate::session::link::Guest;

/// See the module.
pub(crate) trait Host: Send + Sync {
    /// Whether sessions are served; else why not.
    fn ready(&self) -> Result<(), String>;

    /// What it counts and how it is, for people; or that it is too early to tell.
    fn health(&self) -> Result<serde_json::Value, String>;

    /// Its figures, as Prometheus reads them; the same.
    fn metrics(&self, peers: &Peers) -> Result<String, String>;

    /// What is made for each session, the same; `None` where nothing is made.
    fn plan(&self) -> Result<Option<serde_json::Value>, String>;

    /// Whom a client may follow, where it can do nothing else.
    fn to_follow(&self) -> Vec<String> {
        Vec::new()
    }

    /// Runs a session until it ends.
    fn run(self: Arc<Self>, socket: WebSocket, guest: Guest) -> Session;
}

/// A session that runs.
pub(crate) type Session = Pin<Box<dyn Future<Output = ()> + Send>>;
