//! What one port answers: the web client, the websocket, and what a host asks: `/livez`, `/readyz`, `/healthz`, `/metrics`, `/plan`.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Extension, Query, Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Json, Response};
use axum::routing::get;
use protocol::message::SUBPROTOCOL;
use serde::Deserialize;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::access::{self, Access, Refused, SECURITY_HEADERS, TLS_ONLY};
use crate::config::Config;
use crate::peers::{Caller, Crowded, Peers, Place};
use crate::serving::Serving;
use crate::session::{self, Guest, Shared};
use crate::{metrics, page};

/// Where sessions are.
const WEBSOCKET: &str = "/ws";
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
    peers: Arc<Peers>,
    serving: Arc<Serving>,
}

impl Gate {
    /// By a server's options.
    pub(crate) fn new(config: &Config, serving: Arc<Serving>, peers: Arc<Peers>) -> Gate {
        Gate { access: config.access.clone(), peers, serving }
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

/// All that is answered.
pub(crate) fn router(gate: Arc<Gate>, config: &Config) -> Router {
    let mut router = page::router(config.web.as_deref())
        .route("/livez", get(async || "alive\n"))
        .route("/readyz", get(ready))
        .route("/healthz", get(health))
        .route("/metrics", get(measures))
        .route("/plan", get(plan))
        .route(WEBSOCKET, get(websocket))
        .layer(from_fn(within_limits))
        .with_state(gate);
    let over_tls = config.tls.as_ref().filter(|tls| tls.is_of_files()).map(|_| TLS_ONLY);
    for (name, value) in SECURITY_HEADERS.into_iter().chain(over_tls) {
        router = router.layer(SetResponseHeaderLayer::if_not_present(name, value));
    }
    router
}

/// Answers no request of an address that has too many connections open, but that of a websocket, which is told as one.
async fn within_limits(Extension(caller): Extension<Caller>, request: Request, next: Next) -> Response {
    match caller.crowded {
        Some(crowded) if request.uri().path() != WEBSOCKET => turned_away(crowded),
        _ => next.run(request).await,
    }
}

/// An answer for who takes too much.
fn turned_away(crowded: Crowded) -> Response {
    let status = match crowded {
        Crowded::Server => StatusCode::SERVICE_UNAVAILABLE,
        _ => StatusCode::TOO_MANY_REQUESTS,
    };
    (status, [(header::RETRY_AFTER, "1")], format!("{crowded}\n")).into_response()
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
    Ok(([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], metrics::text(&shared, &gate.peers)))
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
    Extension(Caller { peer, crowded }): Extension<Caller>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let asks = gate.peers.who_asks(peer, &headers);
    // Who stands there is also who is told why he may not stay, so that many cannot.
    let doorstep = match gate.peers.doorstep(asks) {
        Ok(doorstep) => doorstep,
        Err(crowded) => {
            tracing::debug!(peer = %asks, "websocket refused: {crowded}");
            return turned_away(crowded);
        }
    };
    let within = gate.peers.may_shake_hands(asks).and_then(|()| crowded.map_or(Ok(()), Err));
    // Behind a proxy all connections are the proxy's.
    let place = within.and_then(|()| if asks == peer { Ok(Place::default()) } else { gate.peers.takes_place(asks) });
    let checked = access::check(&headers, asked.token.as_deref(), &gate.access);
    let origin = headers.get(header::ORIGIN).and_then(|origin| origin.to_str().ok()).map(str::to_owned);
    let by_token = gate.access.token.is_some();
    let shared = gate.serving.open();
    let peer = asks;
    upgrade
        .protocols([SUBPROTOCOL])
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES)
        .read_buffer_size(READ_BUFFER_BYTES)
        .write_buffer_size(WRITE_BUFFER_BYTES)
        .max_write_buffer_size(MAX_WRITE_BUFFER_BYTES)
        .on_failed_upgrade(move |error| tracing::warn!(%peer, "websocket not opened: {error}"))
        .on_upgrade(move |socket| async move {
            let place = match place {
                Ok(place) => place,
                Err(crowded) => return session::refuse(socket, &crowded.to_string(), true).await,
            };
            if let Err(refused) = checked {
                // A browser shows its page nothing of an answer that is no websocket: it is opened, to say why.
                tracing::warn!(%peer, "refused: {refused}");
                return session::refuse(socket, &refused.to_string(), false).await;
            }
            let shared = match shared {
                Ok(shared) => shared,
                Err(said) => return session::refuse(socket, &said, true).await,
            };
            let guest = Guest { peer, doorstep, place, by_token, origin };
            session::run(&shared, socket, guest).await;
        })
}
