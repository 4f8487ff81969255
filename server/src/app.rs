//! One port for everything: the web client, the websocket, `/healthz`, and `/plan`.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::Router;
use axum::extract::{ConnectInfo, Query, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{Html, IntoResponse, Json, Response};
use axum::routing::get;
use axum::serve::{Listener, ListenerExt, TapIo};
use scene::Scene;
use serde::Deserialize;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinHandle;
use tower_http::compression::CompressionLayer;
use tower_http::services::ServeDir;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::access::{self, SECURITY_HEADERS};
use crate::config::Config;
use crate::imager::Imager;
use crate::memory;
use crate::session::{self, Shared};
use crate::stats::Stats;

/// A client's message is under 200 bytes; see `protocol`'s limits.
const MAX_MESSAGE_BYTES: usize = 4096;
/// Room for a few small messages: clients send nothing large.
const READ_BUFFER_BYTES: usize = 4096;
/// Messages leave as soon as they are written; what piles up beyond one update's fragment is an error.
const WRITE_BUFFER_BYTES: usize = 0;
const MAX_WRITE_BUFFER_BYTES: usize = 256 * 1024;
/// How long sessions have to say goodbye when the server stops.
const FAREWELL: Duration = Duration::from_secs(2);

/// Why a server did not start or went down.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The address is taken or not ours.
    #[error("cannot listen on {addr}")]
    Listen {
        /// Where.
        addr: SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The thread that renders could not be started.
    #[error("cannot start the rendering thread: {0}")]
    Thread(std::io::Error),
}

/// A server that runs in the background until it is stopped. Dropping it leaves it running.
pub struct Running {
    /// Where it listens.
    pub addr: SocketAddr,
    /// What it counts.
    pub stats: Arc<Stats>,
    stop: watch::Sender<bool>,
    shared: Arc<Shared>,
    task: JoinHandle<()>,
}

impl Running {
    /// Where a browser finds it.
    pub fn url(&self) -> String {
        let scheme = if self.shared.config.tls.is_some() { "https" } else { "http" };
        format!("{scheme}://{}", self.addr)
    }

    /// Says goodbye to every client and stops.
    pub async fn stop(self) {
        self.stop.send_replace(true);
        let sessions = self.shared.config.limits.clients as u32;
        if tokio::time::timeout(FAREWELL, self.shared.places.acquire_many(sessions)).await.is_err() {
            tracing::warn!("some clients did not take the goodbye in time");
        }
        if tokio::time::timeout(FAREWELL, self.task).await.is_err() {
            tracing::warn!("some requests did not end in time");
        }
    }

    /// Waits until the server can make no more images, and says why. For a process that lives as long as its server.
    pub async fn failed(&self) -> String {
        let mut failure = self.shared.worker.failure();
        let reason = failure.wait_for(Option::is_some).await.map(|reason| reason.clone());
        reason.ok().flatten().unwrap_or_else(|| "the rendering thread ended".to_owned())
    }
}

/// Starts a server for a scene. The imager must have been made for the same scene.
pub async fn serve(config: Config, scene: Arc<Scene>, imager: Box<dyn Imager>) -> Result<Running, ServeError> {
    let addr = SocketAddr::new(config.bind, config.port);
    let listen_error = |source| ServeError::Listen { addr, source };
    let listener = TcpListener::bind(addr).await.map_err(listen_error)?;
    let addr = listener.local_addr().map_err(listen_error)?;
    let (stop, stopped) = watch::channel(false);
    let places = Arc::new(Semaphore::new(config.limits.clients));
    let shared = Arc::new(Shared::new(config, scene, imager, places, stopped.clone()).map_err(ServeError::Thread)?);
    let stats = shared.stats.clone();
    let tls = shared.config.tls.clone();
    let router = router(shared.clone());
    let give_back = tokio::spawn(memory::give_back_after(shared.ended.clone()));
    let forget = tokio::spawn(memory::give_back_unasked(stats.pool.clone()));
    let task = tokio::spawn(async move {
        match tls {
            None => answer(listener.tap_io(|stream| send_at_once(stream)), router, stopped).await,
            Some(tls) => {
                answer(tls.listen(listener).tap_io(|stream| send_at_once(stream.get_ref().0)), router, stopped).await;
            }
        }
        give_back.abort();
        forget.abort();
    });
    Ok(Running { addr, stats, stop, shared, task })
}

/// Answers who connects, until the server is to stop.
async fn answer<L, F>(listener: TapIo<L, F>, router: Router, mut stopped: watch::Receiver<bool>)
where
    L: Listener<Addr = SocketAddr>,
    F: FnMut(&mut L::Io) + Send + 'static,
{
    let service = router.into_make_service_with_connect_info::<SocketAddr>();
    let stop = async move { session::stop_asked(&mut stopped).await };
    if let Err(error) = axum::serve(listener, service).with_graceful_shutdown(stop).await {
        tracing::error!("the server went down: {error}");
    }
}

/// A pose that waits for an acknowledgement of the last one is late.
fn send_at_once(stream: &TcpStream) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("no TCP_NODELAY: {error}");
    }
}

fn router(shared: Arc<Shared>) -> Router {
    let files = Router::new().fallback_service(
        ServeDir::new(&shared.config.web)
            .precompressed_br()
            .precompressed_gzip()
            .fallback(missing_page(&shared.config.web)),
    );
    let mut router = files
        .layer(CompressionLayer::new())
        .route("/healthz", get(health))
        .route("/plan", get(plan))
        .route("/ws", get(websocket))
        .with_state(shared);
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

async fn health(State(shared): State<Arc<Shared>>) -> Response {
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
    (status, Json(answer)).into_response()
}

/// What is made for each session, and what is left out, for who may connect.
async fn plan(State(shared): State<Arc<Shared>>, Query(asked): Query<Asked>, headers: HeaderMap) -> Response {
    if let Err(refused) = access::check(&headers, asked.token.as_deref(), &shared.config.access) {
        return (StatusCode::FORBIDDEN, format!("{refused}\n")).into_response();
    }
    Json(serde_json::json!({ "scene": shared.scene.name, "sessions": shared.plans.json() })).into_response()
}

#[derive(Deserialize)]
struct Asked {
    token: Option<String>,
}

async fn websocket(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(peer): ConnectInfo<SocketAddr>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Ok(doorstep) = shared.doorsteps.clone().try_acquire_owned() else {
        tracing::warn!(%peer, "websocket refused: {} others have not said who they are", shared.config.limits.doorsteps);
        return (StatusCode::SERVICE_UNAVAILABLE, "too many who have not said who they are\n").into_response();
    };
    let checked = access::check(&headers, asked.token.as_deref(), &shared.config.access);
    upgrade
        .protocols([access::PROTOCOL])
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
            shared.stats.clients.fetch_add(1, Ordering::Relaxed);
            shared.stats.connected.fetch_add(1, Ordering::Relaxed);
            session::run(&shared, socket, peer, doorstep).await;
            shared.stats.clients.fetch_sub(1, Ordering::Relaxed);
            shared.ended.notify_one();
        })
}
