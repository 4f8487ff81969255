//! A server with its scene, as its port sees it.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::ws::WebSocket;

use crate::host::{Guest, Host, Session};
use crate::metrics;
use crate::peers::Peers;
use crate::serving::within::Within;
use crate::serving::{NotOpen, Serving};
use crate::session::link::refuse;
use crate::session::{self, Shared};
use crate::uploads::Uploads;

impl Host for Serving {
    fn ready(&self) -> Result<(), String> {
        self.open(None, &Within::default())
            .map_err(|not_open| not_open.why)?
            .worker
            .failure()
            .borrow()
            .clone()
            .map_or(Ok(()), Err)
    }

    fn health(&self) -> Result<serde_json::Value, String> {
        let shared = self.shared()?;
        let mut answer = shared.house.stats.json(&shared.pool);
        let failure = shared.worker.failure().borrow().clone();
        if let Some(object) = answer.as_object_mut() {
            object.insert("ok".into(), failure.is_none().into());
            object.insert("failure".into(), failure.into());
            object.insert("scene".into(), shared.scene.name.clone().into());
            object.insert("adapter".into(), shared.adapter.clone().into());
        }
        Ok(answer)
    }

    fn metrics(&self, peers: &Peers) -> Result<String, String> {
        self.shared()?;
        Ok(metrics::text(&self.open_ones(), self.has_others(), peers))
    }

    fn plan(&self) -> Result<Option<serde_json::Value>, String> {
        self.shared()?;
        let plan = |(name, shared): (String, Arc<Shared>)| serde_json::json!({ "scene": name, "sessions": shared.plans.json() });
        let mut plans: Vec<_> = self.open_ones().into_iter().map(plan).collect();
        // Where there is but one scene, it alone is told of.
        Ok(Some(if self.has_others() { plans.into() } else { plans.swap_remove(0) }))
    }

    fn scenes(&self) -> serde_json::Value {
        self.list()
    }

    fn offered(&self, scene: Option<&str>, within: &Within) -> Option<serde_json::Value> {
        self.offered(scene, within)
    }

    fn thumbnail(&self, scene: &str) -> Option<Bytes> {
        self.thumbnail(scene)
    }

    fn uploads(&self) -> Option<Arc<Uploads>> {
        self.uploads()
    }

    fn run(self: Arc<Self>, socket: WebSocket, guest: Guest) -> Session {
        Box::pin(async move {
            let (scene, within) = (guest.scene.clone(), guest.within.clone());
            // It may read a folder.
            let opened = tokio::task::spawn_blocking(move || self.open(scene.as_deref(), &within)).await;
            match opened {
                Ok(Ok(shared)) => session::run(&shared, socket, guest).await,
                Ok(Err(NotOpen { why, again })) => refuse(socket, &why, again).await,
                Err(fault) => refuse(socket, &fault.to_string(), true).await,
            }
        })
    }
}
