//! What is there behind a port: a server with its scene, or a relay.

use std::future::Future;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::ws::WebSocket;

use crate::peers::{Doorstep, Peers, Place};
use crate::serving::within::Within;
use crate::uploads::Uploads;

/// See the module.
pub(crate) trait Host: Send + Sync {
    /// Whether sessions are served; else why not.
    fn ready(&self) -> Result<(), String>;

    /// What it counts and how it is, for people; or that it is too early to tell.
    fn health(&self) -> Result<serde_json::Value, String>;

    /// Its figures, as Prometheus reads them, with those of its port; the same.
    fn metrics(&self, peers: &Peers) -> Result<String, String>;

    /// What is made for each session, the same; `None` where nothing is made.
    fn plan(&self) -> Result<Option<serde_json::Value>, String>;

    /// Whom a client may follow, where it can do nothing else.
    fn to_follow(&self) -> Vec<String> {
        Vec::new()
    }

    /// All scenes that a session may ask for, and how large what people bring may be; none where nothing is shown but what is relayed. May read a folder.
    fn scenes(&self) -> serde_json::Value {
        serde_json::json!({ "scenes": [], "uploads": null })
    }

    /// What may be chosen within the file of a scene that is shown now; `None` where it is not.
    fn offered(&self, _scene: Option<&str>, _within: &Within) -> Option<serde_json::Value> {
        None
    }

    /// A small picture of a scene, a JPEG.
    fn thumbnail(&self, _scene: &str) -> Option<Bytes> {
        None
    }

    /// Where people bring scenes of their own; `None` where they may not.
    fn uploads(&self) -> Option<Arc<Uploads>> {
        None
    }

    /// Runs a session until it ends. A fault of its own ends it, and nothing else.
    fn run(self: Arc<Self>, socket: WebSocket, guest: Guest) -> Session;
}

/// Who comes for a session, and by what right.
pub(crate) struct Guest {
    /// From where.
    pub peer: SocketAddr,
    /// The scene that it asks for; `None`: whichever there is.
    pub scene: Option<String>,
    /// What of its file.
    pub within: Within,
    /// Until it has greeted.
    pub doorstep: Doorstep,
    /// Among the connections of its address, where it comes by way of a proxy.
    pub place: Place,
    /// Whether it knew the token.
    pub by_token: bool,
    /// The page's, of a browser.
    pub origin: Option<String>,
}

/// A session that runs.
pub(crate) type Session = Pin<Box<dyn Future<Output = ()> + Send>>;
