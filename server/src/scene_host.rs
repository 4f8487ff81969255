//! A server with its scene, as its port sees it.

use std::sync::Arc;

use axum::extract::ws::WebSocket;

use crate::host::{Guest, Host, Session};
use crate::metrics;
use crate::peers::Peers;
use crate::serving::Serving;
use crate::session;
use crate::session::link::refuse;

impl Host for Serving {
    fn ready(&self) -> Result<(), String> {
        self.open()?.worker.failure().borrow().clone().map_or(Ok(()), Err)
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
        Ok(metrics::text(&*self.shared()?, peers))
    }

    fn plan(&self) -> Result<Option<serde_json::Value>, String> {
        let shared = self.shared()?;
        Ok(Some(serde_json::json!({ "scene": shared.scene.name, "sessions": shared.plans.json() })))
    }

    fn run(self: Arc<Self>, socket: WebSocket, guest: Guest) -> Session {
        Box::pin(async move {
            match self.open() {
                Ok(shared) => session::run(&shared, socket, guest).await,
                Err(said) => refuse(socket, &said, true).await,
            }
        })
    }
}
