//! A server's life: it listens, its scene is loaded, it serves, it stops.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::serve::{Listener, ListenerExt, TapIo};
use scene::Scene;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinHandle;

use crate::config::Config;
use crate::imager::Imager;
use crate::memory;
use crate::routes::{self, Gate};
use crate::session::{self, Shared};
use crate::stats::Stats;

/// Bytes that the system takes before the path does: a fragment of an update is 32 KiB.
#[cfg(any(target_os = "linux", target_os = "android"))]
const UNSENT_BYTES: u32 = 16 * 1024;
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

/// A server that listens, while its scene is loaded: who comes is told so.
pub struct Listening {
    /// Where it listens.
    pub addr: SocketAddr,
    url: String,
    gate: Arc<Gate>,
    stop: watch::Sender<bool>,
    task: JoinHandle<()>,
}

/// A server that runs in the background until it is stopped. Dropping it leaves it running.
pub struct Running {
    /// Where it listens.
    pub addr: SocketAddr,
    /// What it counts.
    pub stats: Arc<Stats>,
    url: String,
    stop: watch::Sender<bool>,
    shared: Arc<Shared>,
    tasks: [JoinHandle<()>; 3],
}

/// Listens, as the options of a server say that are about its port.
pub async fn listen(config: &Config) -> Result<Listening, ServeError> {
    let addr = SocketAddr::new(config.bind, config.port);
    let listen_error = |source| ServeError::Listen { addr, source };
    let listener = TcpListener::bind(addr).await.map_err(listen_error)?;
    let addr = listener.local_addr().map_err(listen_error)?;
    let (stop, stopped) = watch::channel(false);
    let gate = Arc::new(Gate::new(config));
    let (router, tls) = (routes::router(gate.clone(), &config.web), config.tls.clone());
    let scheme = if tls.is_some() { "https" } else { "http" };
    let task = tokio::spawn(async move {
        match tls {
            None => answer(listener.tap_io(|stream| set_up(stream)), router, stopped).await,
            Some(tls) => {
                answer(tls.listen(listener).tap_io(|stream| set_up(stream.get_ref().0)), router, stopped).await;
            }
        }
    });
    Ok(Listening { addr, url: format!("{scheme}://{addr}"), gate, stop, task })
}

impl Listening {
    /// Where a browser finds it.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// What is shown to who comes: how far the scene is.
    pub fn progress(&self) -> impl Fn(String) + Send + Sync + 'static {
        let gate = self.gate.clone();
        move |said| gate.says(said)
    }

    /// Serves a scene from now on. The imager must have been made for it, and `config` must be that which it listens by.
    pub fn serve(self, config: Config, scene: Arc<Scene>, imager: Box<dyn Imager>) -> Result<Running, ServeError> {
        let places = Arc::new(Semaphore::new(config.limits.clients));
        let shared = Shared::new(config, scene, imager, places, self.stop.subscribe()).map_err(ServeError::Thread)?;
        let shared = Arc::new(shared);
        self.gate.opens(shared.clone());
        let stats = shared.stats.clone();
        let give_back = tokio::spawn(memory::give_back_after(shared.ended.clone()));
        let forget = tokio::spawn(memory::give_back_unasked(stats.pool.clone()));
        let tasks = [self.task, give_back, forget];
        Ok(Running { addr: self.addr, stats, url: self.url, stop: self.stop, shared, tasks })
    }
}

/// Starts a server for a scene. The imager must have been made for the same scene.
pub async fn serve(config: Config, scene: Arc<Scene>, imager: Box<dyn Imager>) -> Result<Running, ServeError> {
    listen(&config).await?.serve(config, scene, imager)
}

impl Running {
    /// Where a browser finds it.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Says goodbye to every client and stops.
    pub async fn stop(self) {
        self.stop.send_replace(true);
        let sessions = self.shared.config.limits.clients as u32;
        if tokio::time::timeout(FAREWELL, self.shared.places.acquire_many(sessions)).await.is_err() {
            tracing::warn!("some clients did not take the goodbye in time");
        }
        let [answers, give_back, forget] = self.tasks;
        if tokio::time::timeout(FAREWELL, answers).await.is_err() {
            tracing::warn!("some requests did not end in time");
        }
        give_back.abort();
        forget.abort();
    }

    /// Waits until the server can make no more images, and says why. For a process that lives as long as its server.
    pub async fn failed(&self) -> String {
        let mut failure = self.shared.worker.failure();
        let reason = failure.wait_for(Option::is_some).await.map(|reason| reason.clone());
        reason.ok().flatten().unwrap_or_else(|| "the rendering thread ended".to_owned())
    }
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

/// What waits for an acknowledgement of the last packet is late. And what the system has taken can neither be overtaken by an answer nor be replaced by something newer, so it takes
/// little before the path does.
fn set_up(stream: &TcpStream) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!("no TCP_NODELAY: {error}");
    }
    #[cfg(any(target_os = "linux", target_os = "android"))]
    if let Err(error) = socket2::SockRef::from(stream).set_tcp_notsent_lowat(UNSENT_BYTES) {
        tracing::debug!("no TCP_NOTSENT_LOWAT: {error}");
    }
}
