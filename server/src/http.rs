//! HTTP over connections that were let in, with time-outs: who sends a request slowly, takes an answer slowly or does nothing holds a connection for so
//! long, and no longer. A websocket has time-outs of its own from its upgrade on, see [`crate::session`].

use std::time::Duration;

use axum::Router;
use axum::http::Request;
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::peers::Caller;

/// A request's head must be there so long after the connection is, or after the last answer: so a connection that is kept for further requests ends, too.
const HEAD_WITHIN: Duration = Duration::from_secs(15);
/// All that one connection asks for and is answered, until it becomes a websocket or ends. At 300 kbit/s that is the largest file of a page three times over.
const ALL_WITHIN: Duration = Duration::from_secs(300);
/// Browsers send some 20 headers of 1 kB together.
const MOST_HEADERS: usize = 64;
const HEAD_BYTES: usize = 16 * 1024;

/// Answers who connects, until the server is to stop; then every request that has begun, and no further one.
pub(crate) async fn answer(
    mut listener: impl Listener<Addr = Caller>,
    router: Router,
    mut stopped: watch::Receiver<bool>,
) {
    let mut connections = JoinSet::new();
    let router = TowerToHyperService::new(router);
    loop {
        tokio::select! {
            (io, caller) = listener.accept() => {
                connections.spawn(serve(io, caller, router.clone(), stopped.clone()));
            }
            Some(_) = connections.join_next() => {}
            () = stop_asked(&mut stopped) => break,
        }
    }
    drop(listener);
    while connections.join_next().await.is_some() {}
}

/// Serves one connection until it ends, becomes a websocket, or has had its time.
async fn serve(
    io: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    caller: Caller,
    router: TowerToHyperService<Router>,
    mut stopped: watch::Receiver<bool>,
) {
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(caller);
        router.call(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WITHIN)
        .max_headers(MOST_HEADERS)
        .max_header_size(HEAD_BYTES)
        .serve_connection(TokioIo::new(io), service)
        .with_upgrades();
    let mut connection = std::pin::pin!(connection);
    let served = tokio::time::timeout(ALL_WITHIN, async {
        tokio::select! {
            ended = connection.as_mut() => return ended,
            () = stop_asked(&mut stopped) => {}
        }
        connection.as_mut().graceful_shutdown();
        connection.await
    });
    let peer = caller.peer;
    match served.await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::debug!(%peer, "not HTTP: {error}"),
        Err(_) => tracing::debug!(%peer, "hung up on after {} s", ALL_WITHIN.as_secs()),
    }
}

/// Waits until the server is to stop; for ever where nobody can stop it any more.
async fn stop_asked(stopped: &mut watch::Receiver<bool>) {
    if stopped.wait_for(|&stop| stop).await.is_err() {
        std::future::pending::<()>().await;
    }
}
