//! What one port answers: the web client, the websocket, and what a host asks: `/livez`, `/readyz`, `/healthz`, `/metrics`, `/plan`.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use axum::Router;
use axum::extract::{ConnectInfo, Query, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse, Json, Response};
use axum::routing::get;
use protocol::message::SUBPROTOCOL;
use serde::Deserialize;
use tokio::sync::Semaphore;
use tower_http::compression::CompressionLayer;
use tower_http::services::ServeDir;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::access::{self, Access, Refused, SECURITY_HEADERS};
use crate::config::Config;
use crate::metrics;
use crate::session::{self, Shared};

/// A client's message is under 200 bytes; see `protocol`'s limits.
const MAX_MESSAGE_BYTES: usize = 4096;
/// Room for a few small messages: clients send nothing large.
const READ_BUFFER_BYTES: usize = 4096;
/// Messages leave as soon as they are written; what piles up beyond one update's fragment is an error.
const WRITE_BUFFER_BYTES: usize = 0;
const MAX_WRITE_BUFFER_BYTES: usize = 256 * 1024;

/// What is there behind the port: nothing while the scene is loaded, then all that sessions share.
pub(crate) struct Gate {
    access: Access,
    /// One permit a connection that has not said who it is.
    doorsteps: Arc<Semaphore>,
    shared: OnceLock<Arc<Shared>>,
    /// How far loading is.
    said: Mutex<String>,
}

impl Gate {
    /// Closed, by a server's options.
    pub(crate) fn new(config: &Config) -> Gate {
        let doorsteps = Arc::new(Semaphore::new(config.limits.doorsteps));
        Gate { access: config.access.clone(), doorsteps, shared: OnceLock::new(), said: Mutex::default() }
    }

    /// Says how far loading is.
    pub(crate) fn says(&self, said: String) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = said;
    }

    /// From now on sessions are served. Once.
    pub(crate) fn opens(&self, shared: Arc<Shared>) {
        let _ = self.shared.set(shared);
    }

    /// Or what to tell who comes too early.
    fn shared(&self) -> Result<&Arc<Shared>, String> {
        self.shared.get().ok_or_else(|| {
            let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
            if said.is_empty() {
                "the scene is being loaded".to_owned()
            } else {
                format!("the scene is being loaded: {said}")
            }
        })
    }

    /// For who may read what is told of a server.
    fn shared_with(&self, asked: &Asked, headers: &HeaderMap) -> Result<&Arc<Shared>, Untold> {
        access::check_reader(headers, asked.token.as_deref(), &self.access).map_err(Untold::Refused)?;
        self.shared().map_err(Untold::Early)
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

/// All that is answered; `web`: the folder of the built web client.
pub(crate) fn router(gate: Arc<Gate>, web: &Path) -> Router {
    let files = Router::new()
        .fallback_service(ServeDir::new(web).precompressed_br().precompressed_gzip().fallback(missing_page(web)));
    let mut router = files
        .layer(CompressionLayer::new())
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

/// What is shown for a path without a file: how to build the client where it is not built, else nothing.
fn missing_page(web: &Path) -> Router {
    let index = web.join("index.html");
    Router::new().fallback(move |uri: axum::http::Uri| async move {
        if uri.path() == "/" && !index.is_file() {
            (StatusCode::OK, Html(NOT_BUILT)).into_response()
        } else {
            (StatusCode::NOT_FOUND, "not found\n").into_response()
        }
    })
}

const NOT_BUILT: &str = "<!doctype html><meta charset=\"utf-8\"><title>Vantage</title>\
    <h1>Vantage is running</h1>\
    <p>The web client is not built. <code>cargo xtask serve</code> builds it and starts the server; a server that runs \
    already finds the client in the folder that <code>--web</code> names.</p>\
    <p>The native client works now: <code>vantage-view</code>.</p>\n";

/// Whether sessions are served.
async fn ready(State(gate): State<Arc<Gate>>) -> Response {
    let failure = gate.shared().and_then(|shared| shared.worker.failure().borrow().clone().map_or(Ok(()), Err));
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
    Ok(([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], metrics::text(shared)))
}

async fn health(State(gate): State<Arc<Gate>>) -> Result<Response, Untold> {
    let shared = gate.shared().map_err(Untold::Early)?;
    let mut answer = shared.stats.json();
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
    let shared = gate.shared().cloned();
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
            shared.stats.clients.fetch_add(1, Ordering::Relaxed);
            shared.stats.connected.fetch_add(1, Ordering::Relaxed);
            session::run(&shared, socket, peer, doorstep).await;
            shared.stats.clients.fetch_sub(1, Ordering::Relaxed);
            shared.ended.notify_one();
        })
}
