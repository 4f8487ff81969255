//! A server as a game server of Agones, which keeps such on Kubernetes: it says when it is ready, that it is well, when somebody has come, and when it may go.
//!
//! It speaks to what Agones runs beside it in the same pod (`sdk.swagger.json` of Agones): `POST /ready`, `/health`, `/allocate`, `/shutdown` and
//! `GET /gameserver`, all on `localhost`. That may come up later than this server, and what goes wrong is tried again, so a failure is a warning and nothing else.

use std::time::Duration;

use axum::body::Bytes;
use axum::http::{Method, Request, StatusCode, header};
use http_body_util::{BodyExt, Full, Limited};
use hyper_util::rt::TokioIo;
use serde::Deserialize;
use thiserror::Error;
use tokio::net::TcpStream;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

/// Where it listens, where `AGONES_SDK_HTTP_PORT` does not say otherwise.
pub const DEFAULT_PORT: u16 = 9358;
/// Far more often than the five seconds after which Agones begins to doubt a server by default.
const BEAT: Duration = Duration::from_secs(2);
/// An answer on the same machine is there in milliseconds.
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);
/// An answer about this server is of a few kilobytes.
const MAX_ANSWER_BYTES: usize = 1 << 20;
/// The state of a server that somebody was given.
const ALLOCATED: &str = "Allocated";

/// Why Agones was not told something.
#[derive(Debug, Error)]
enum SdkError {
    #[error(transparent)]
    Unreachable(#[from] std::io::Error),
    #[error("no answer within {} s", ANSWERS_WITHIN.as_secs())]
    Silent,
    #[error(transparent)]
    Http(#[from] hyper::Error),
    #[error("{0}")]
    Body(Box<dyn std::error::Error + Send + Sync>),
    #[error("it answers {0}")]
    Status(StatusCode),
    #[error("an answer that is not understood: {0}")]
    Json(#[from] serde_json::Error),
}

/// The part of what is told about a server that is of use here.
#[derive(Debug, Deserialize)]
struct GameServer {
    status: Option<Status>,
}

#[derive(Debug, Deserialize)]
struct Status {
    state: Option<String>,
}

/// Tells Agones on a port of this machine about this server, until it has told it that the server may go: nobody has been there for `idle` since somebody was,
/// or since it was allocated to somebody who never came. `sessions`: how many are there; `None` while nobody may come.
pub async fn tend(port: u16, idle: Duration, sessions: impl Fn() -> Option<usize>) {
    let (mut is_ready, mut is_allocated) = (false, false);
    let mut alone_since: Option<Instant> = None;
    let mut beat = interval(BEAT);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        beat.tick().await;
        tell(port, "/health").await;
        let Some(sessions) = sessions() else { continue };
        if !is_ready {
            is_ready = tell(port, "/ready").await;
            continue;
        }
        if !is_allocated {
            is_allocated = if sessions > 0 { tell(port, "/allocate").await } else { was_allocated(port).await };
        }
        if !is_allocated || sessions > 0 {
            alone_since = None;
        } else if alone_since.get_or_insert_with(Instant::now).elapsed() >= idle && tell(port, "/shutdown").await {
            tracing::info!("nobody has been here for {} s: Agones was told that this server may go", idle.as_secs());
            return;
        }
    }
}

/// Whether it was told, and took it.
async fn tell(port: u16, path: &str) -> bool {
    match call(port, Method::POST, path).await {
        Ok(_) => {
            tracing::debug!("told Agones {path}");
            true
        }
        Err(error) => {
            tracing::warn!("Agones was not told {path}: {error}");
            false
        }
    }
}

/// Whether somebody was given this server.
async fn was_allocated(port: u16) -> bool {
    let answer = call(port, Method::GET, "/gameserver").await;
    match answer.and_then(|body| Ok(serde_json::from_slice::<GameServer>(&body)?)) {
        Ok(server) => server.status.and_then(|status| status.state).is_some_and(|state| state == ALLOCATED),
        Err(error) => {
            tracing::warn!("Agones does not say what this server is: {error}");
            false
        }
    }
}

async fn call(port: u16, method: Method, path: &str) -> Result<Bytes, SdkError> {
    timeout(ANSWERS_WITHIN, ask(port, method, path)).await.unwrap_or(Err(SdkError::Silent))
}

async fn ask(port: u16, method: Method, path: &str) -> Result<Bytes, SdkError> {
    let stream = TcpStream::connect(("localhost", port)).await?;
    let (mut sender, connection) = hyper::client::conn::http1::handshake(TokioIo::new(stream)).await?;
    // It ends with the answer, and what it ends by is the answer's.
    let connection = tokio::spawn(connection);
    let body = if method == Method::POST { "{}" } else { "" };
    let request = Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "localhost")
        .header(header::CONTENT_TYPE, "application/json")
        .body(Full::new(Bytes::from_static(body.as_bytes())))
        .map_err(|error| SdkError::Body(error.into()))?;
    let answer = sender.send_request(request).await?;
    let status = answer.status();
    let body = Limited::new(answer.into_body(), MAX_ANSWER_BYTES).collect().await.map_err(SdkError::Body);
    connection.abort();
    if status.is_success() { Ok(body?.to_bytes()) } else { Err(SdkError::Status(status)) }
}
