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
use tokio::time::Instant;

use crate::peers::Caller;

/// A request's head must be there so long after the connection is, or after the last answer: so a connection that is kept for further requests ends, too.
const HEAD_WITHIN: Duration = Duration::from_secs(15);
/// All that one connection asks for and is answered, until it becomes a websocket or ends, unless it is allowed more. At 300 kbit/s that is the largest file of a page three times over.
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
    let (more_time, mut asked) = MoreTime::new();
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(caller);
        request.extensions_mut().insert(more_time.clone());
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
    let served = within(&mut asked, async {
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
        Err(Elapsed) => tracing::debug!(%peer, "hung up on: it had its time"),
    }
}

/// Lets what a request does take longer than connections have.
#[derive(Debug, Clone)]
pub(crate) struct MoreTime(watch::Sender<Duration>);

impl MoreTime {
    fn new() -> (MoreTime, watch::Receiver<Duration>) {
        let (sender, receiver) = watch::channel(ALL_WITHIN);
        (MoreTime(sender), receiver)
    }

    /// The connection may be there for so long, from its beginning on.
    pub fn allow(&self, time: Duration) {
        self.0.send_replace(time);
    }
}

/// The time is over.
struct Elapsed;

/// What a connection comes to, if it does within its time.
async fn within<T>(time: &mut watch::Receiver<Duration>, does: impl Future<Output = T>) -> Result<T, Elapsed> {
    let begun = Instant::now();
    let mut does = std::pin::pin!(does);
    loop {
        let until = begun + *time.borrow_and_update();
        tokio::select! {
            done = does.as_mut() => return Ok(done),
            () = tokio::time::sleep_until(until) => return Err(Elapsed),
            Ok(()) = time.changed() => {}
        }
    }
}

/// Waits until the server is to stop; for ever where nobody can stop it any more.
async fn stop_asked(stopped: &mut watch::Receiver<bool>) {
    if stopped.wait_for(|&stop| stop).await.is_err() {
        std::future::pending::<()>().await;
    }
}
