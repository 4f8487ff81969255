//! What one port answers: the web client, the websocket, and what a host asks: `/livez`, `/readyz`, `/healthz`, `/metrics`, `/plan`.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Router;
use axum::extract::{ConnectInfo, Query, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use axum::routing::get;
use protocol::message::SUBPROTOCOL;
use serde::Deserialize;
use tokio::sync::Semaphore;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::access::{self, Access, Refused, SECURITY_HEADERS};
use crate::config::Config;
use crate::serving::Serving;
use crate::session::{self, Shared};
use crate::{metrics, page};

/// A client's message is under 200 bytes; see `protocol`'s limits.
const MAX_MESSAGE_BYTES: usize = 4096;
/// Room for a few small messages: clients send nothing large.
const READ_BUFFER_BYTES: usize = 4096;
/// Messages leave as soon as they are written; what piles up beyond one update's fragment is an error.
const WRITE_BUFFER_BYTES: usize = 0;
const MAX_WRITE_BUFFER_BYTES: usize = 256 * 1024;

/// What is there behind the port, and who may come in.
pub(crate) struct Gate {
    access: Access,
    /// One permit a connection that has not said who it is.
    doorsteps: Arc<Semaphore>,
    serving: Arc<Serving>,
}

impl Gate {
    /// By a server's options.
    pub(crate) fn new(config: &Config, serving: Arc<Serving>) -> Gate {
        let doorsteps = Arc::new(Semaphore::new(config.limits.doorsteps));
        Gate { access: config.access.clone(), doorsteps, serving }
    }

    /// For who may read what is told of a server.
    fn shared_with(&self, asked: &Asked, headers: &HeaderMap) -> Result<Arc<Shared>, Untold> {
        access::check_reader(headers, asked.token.as_deref(), &self.access).map_err(Untold::Refused)?;
        self.serving.shared().map_err(Untold::Early)
    }
}

/// Why nothing is told.
enum Untold {
    Refused(Refused),
    /// The scene is being loaded.
    Early(String),
}

impl IntoResponse for Untold {
    fn into_response(self) -> Response {
        match self {
            Untold::Refused(refused) => (StatusCode::FORBIDDEN, format!("{refused}\n")).into_response(),
            Untold::Early(said) => {
                let answer = serde_json::json!({ "ok": false, "loading": said, "version": env!("CARGO_PKG_VERSION") });
                (StatusCode::SERVICE_UNAVAILABLE, Json(answer)).into_response()
            }
        }
    }
}

/// All that is answered; `web`: the folder of the built web client, where it is not the one that is built in.
pub(crate) fn router(gate: Arc<Gate>, web: Option<&Path>) -> Router {
    let mut router = page::router(web)
        .route("/livez", get(async || "alive\n"))
        .route("/readyz", get(ready))
        .route("/healthz", get(health))
        .route("/metrics", get(measures))
        .route("/plan", get(plan))
        .route("/ws", get(websocket))
        .with_state(gate);
    for (name, value) in SECURITY_HEADERS {
        router = router.layer(SetResponseHeaderLayer::if_not_present(name, value));
    }
    router
}

/// Whether sessions are served.
async fn ready(State(gate): State<Arc<Gate>>) -> Response {
    let failure = gate.serving.open().and_then(|shared| shared.worker.failure().borrow().clone().map_or(Ok(()), Err));
    match failure {
        Ok(()) => "ready\n".into_response(),
        Err(why) => (StatusCode::SERVICE_UNAVAILABLE, format!("{why}\n")).into_response(),
    }
}

/// For Prometheus, where who asks may connect.
async fn measures(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Untold> {
    let shared = gate.shared_with(&asked, &headers)?;
    Ok(([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], metrics::text(&shared)))
}

async fn health(State(gate): State<Arc<Gate>>) -> Result<Response, Untold> {
    let shared = gate.serving.shared().map_err(Untold::Early)?;
    let mut answer = shared.house.stats.json(&shared.pool);
    let failure = shared.worker.failure().borrow().clone();
    if let Some(object) = answer.as_object_mut() {
        object.insert("ok".into(), failure.is_none().into());
        object.insert("failure".into(), failure.clone().into());
        object.insert("scene".into(), shared.scene.name.clone().into());
        object.insert("adapter".into(), shared.adapter.clone().into());
        object.insert("version".into(), env!("CARGO_PKG_VERSION").into());
    }
    let status = if failure.is_none() { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    Ok((status, Json(answer)).into_response())
}

/// What is made for each session, and what is left out, for who may connect.
async fn plan(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<Json<serde_json::Value>, Untold> {
    let shared = gate.shared_with(&asked, &headers)?;
    Ok(Json(serde_json::json!({ "scene": shared.scene.name, "sessions": shared.plans.json() })))
}

#[derive(Deserialize)]
struct Asked {
    token: Option<String>,
}

async fn websocket(
    State(gate): State<Arc<Gate>>,
    ConnectInfo(peer): ConnectInfo<SocketAddr>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Ok(doorstep) = gate.doorsteps.clone().try_acquire_owned() else {
        tracing::warn!(%peer, "websocket refused: too many others have not said who they are");
        return (StatusCode::SERVICE_UNAVAILABLE, "too many who have not said who they are\n").into_response();
    };
    let checked = access::check(&headers, asked.token.as_deref(), &gate.access);
    let shared = gate.serving.open();
    upgrade
        .protocols([SUBPROTOCOL])
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES)
        .read_buffer_size(READ_BUFFER_BYTES)
        .write_buffer_size(WRITE_BUFFER_BYTES)
        .max_write_buffer_size(MAX_WRITE_BUFFER_BYTES)
        .on_failed_upgrade(move |error| tracing::warn!(%peer, "websocket not opened: {error}"))
        .on_upgrade(move |socket| async move {
            if let Err(refused) = checked {
                // A browser shows its page nothing of an answer that is no websocket: it is opened, to say why.
                tracing::warn!(%peer, "refused: {refused}");
                return session::refuse(socket, &refused.to_string(), false).await;
            }
            let shared = match shared {
                Ok(shared) => shared,
                Err(said) => return session::refuse(socket, &said, true).await,
            };
            shared.house.stats.clients.fetch_add(1, Ordering::Relaxed);
            shared.house.stats.connected.fetch_add(1, Ordering::Relaxed);
            session::run(&shared, socket, peer, doorstep).await;
            shared.house.stats.clients.fetch_sub(1, Ordering::Relaxed);
            shared.house.ended.notify_one();
        })
}
