//! What one port answers: the web client, the websocket, and what a host asks: `/livez`, `/readyz`, `/healthz`, `/metrics`, `/plan`,
//! `/scenes` and `/offer`; and what it takes: `/uploads`.

use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Extension, Query, Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Json, Redirect, Response};
use axum::routing::{get, post};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use protocol::message::SUBPROTOCOL;
use serde::Deserialize;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::access::{self, Access, FOR_EVERY_PAGE, Refused, SECURITY_HEADERS, TLS_ONLY};
use crate::config::Config;
use crate::host::{Guest, Host};
use crate::http::MoreTime;
use crate::peers::{Caller, Crowded, Peers, Place};
use crate::serving::within::Within;
use crate::session::link::refuse;
use crate::{figures, page, uploads};

/// The element for pages of others.
const ELEMENT: &str = "/vantage-view.js";
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
    host: Arc<dyn Host>,
}

impl Gate {
    /// By a server's options.
    pub(crate) fn new(config: &Config, host: Arc<dyn Host>, peers: Arc<Peers>) -> Gate {
        Gate { access: config.access.clone(), peers, host }
    }

    /// For who may read what is told of a server.
    fn host_for(&self, asked: &Asked, headers: &HeaderMap) -> Result<&dyn Host, Untold> {
        access::check_reader(headers, asked.token.as_deref(), &self.access).map_err(Untold::Refused)?;
        Ok(self.host.as_ref())
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
        .route("/scenes", get(scenes))
        .route("/offer", get(offer))
        .route("/thumbnail", get(thumbnail))
        .route("/uploads", post(upload))
        .route(WEBSOCKET, get(websocket))
        .layer(from_fn(for_every_page))
        .layer(from_fn_with_state(gate.clone(), lead))
        .layer(from_fn(within_limits))
        .with_state(gate);
    let over_tls = config.tls.as_ref().filter(|tls| tls.is_of_files()).map(|_| TLS_ONLY);
    let policy = (header::CONTENT_SECURITY_POLICY, config.access.content_security_policy());
    for (name, value) in SECURITY_HEADERS.into_iter().chain([policy]).chain(over_tls) {
        router = router.layer(SetResponseHeaderLayer::if_not_present(name, value));
    }
    router
}

/// Lets pages of every origin run the element, which is the same for all and tells nothing.
async fn for_every_page(request: Request, next: Next) -> Response {
    let is_element = request.uri().path() == ELEMENT;
    let mut response = next.run(request).await;
    if is_element {
        response.headers_mut().extend(FOR_EVERY_PAGE);
    }
    response
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

/// A page that names nobody, where one can only follow one person, is led to him. Not where a token is needed: his name is for who knows it.
async fn lead(State(gate): State<Arc<Gate>>, request: Request, next: Next) -> Response {
    let uri = request.uri();
    let query = uri.query().unwrap_or_default();
    let says_whom =
        query.split('&').any(|part| ["follow=", "present=", "camera="].iter().any(|key| part.starts_with(key)));
    if uri.path() == "/"
        && !says_whom
        && gate.access.token.is_none()
        && let [name] = gate.host.to_follow().as_slice()
    {
        let and = if query.is_empty() { "" } else { "&" };
        return Redirect::temporary(&format!("/?{query}{and}follow={}", utf8_percent_encode(name, NON_ALPHANUMERIC)))
            .into_response();
    }
    next.run(request).await
}

/// Whether sessions are served.
async fn ready(State(gate): State<Arc<Gate>>) -> Response {
    match gate.host.ready() {
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
    let text = gate.host_for(&asked, &headers)?.metrics(&gate.peers).map_err(Untold::Early)?;
    Ok(([(header::CONTENT_TYPE, figures::CONTENT_TYPE)], text))
}

async fn health(State(gate): State<Arc<Gate>>) -> Result<Response, Untold> {
    let mut answer = gate.host.health().map_err(Untold::Early)?;
    let status = if answer["ok"] == true { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    answer["version"] = env!("CARGO_PKG_VERSION").into();
    Ok((status, Json(answer)).into_response())
}

/// What is made for each session, and what is left out, for who may connect.
async fn plan(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<Response, Untold> {
    let plan = gate.host_for(&asked, &headers)?.plan().map_err(Untold::Early)?;
    Ok(plan.map_or_else(|| StatusCode::NOT_FOUND.into_response(), |plan| Json(plan).into_response()))
}

/// The scenes that sessions may ask for, and what may be brought, for who may connect.
async fn scenes(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<Response, Untold> {
    gate.host_for(&asked, &headers)?;
    // It reads a folder.
    let scenes = tokio::task::spawn_blocking(move || gate.host.scenes()).await;
    Ok(scenes.map_or_else(|_| StatusCode::INTERNAL_SERVER_ERROR.into_response(), |scenes| Json(scenes).into_response()))
}

/// What may be chosen within the file of a scene that is shown now, for who may connect.
async fn offer(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<Response, Untold> {
    gate.host_for(&asked, &headers)?;
    // It may read a folder.
    let found = tokio::task::spawn_blocking(move || gate.host.offered(asked.scene.as_deref(), &asked.within())).await;
    Ok(Json(found.ok().flatten().unwrap_or_else(|| serde_json::json!({}))).into_response())
}

/// A small picture of a scene, for who may connect.
async fn thumbnail(
    State(gate): State<Arc<Gate>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> Result<Response, Untold> {
    let found = gate.host_for(&asked, &headers)?.thumbnail(asked.scene.as_deref().unwrap_or_default());
    let picture = |bytes: Bytes| ([(header::CONTENT_TYPE, "image/jpeg")], bytes).into_response();
    Ok(found.map_or_else(|| StatusCode::NOT_FOUND.into_response(), picture))
}

/// Takes what a person brings, who may connect.
async fn upload(
    State(gate): State<Arc<Gate>>,
    Extension(more_time): Extension<MoreTime>,
    Query(asked): Query<Asked>,
    request: Request,
) -> Result<Response, Untold> {
    access::check(request.headers(), asked.token.as_deref(), &gate.access).map_err(Untold::Refused)?;
    let Some(uploads) = gate.host.uploads() else {
        return Ok((StatusCode::FORBIDDEN, "this server takes no files: --allow-uploads lets it\n").into_response());
    };
    more_time.allow(uploads.time());
    Ok(match uploads::receive(&uploads, request.into_body()).await {
        Ok(scenes) => Json(serde_json::json!({ "scenes": scenes })).into_response(),
        Err(not_taken) => {
            tracing::info!("an upload is not taken: {not_taken}");
            (not_taken.status(), format!("{not_taken}\n")).into_response()
        }
    })
}

#[derive(Deserialize)]
struct Asked {
    token: Option<String>,
    scene: Option<String>,
    #[serde(rename = "file-scene")]
    file_scene: Option<String>,
    variant: Option<String>,
}

impl Asked {
    fn within(&self) -> Within {
        Within { scene: self.file_scene.clone(), variant: self.variant.clone() }
    }
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
    let (host, peer) = (gate.host.clone(), asks);
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
                Err(crowded) => return refuse(socket, &crowded.to_string(), true).await,
            };
            if let Err(refused) = checked {
                // A browser shows its page nothing of an answer that is no websocket: it is opened, to say why.
                tracing::warn!(%peer, "refused: {refused}");
                return refuse(socket, &refused.to_string(), false).await;
            }
            host.run(
                socket,
                Guest { peer, within: asked.within(), scene: asked.scene, doorstep, place, by_token, origin },
            )
            .await;
        })
}
