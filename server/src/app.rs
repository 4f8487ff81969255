//! A server's life: it listens, its scene is loaded, it serves, perhaps another scene in its place, it stops.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use scene::Scene;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::config::Config;
use crate::host::Host;
use crate::imager::Imager;
use crate::limits::SceneLimits;
use crate::peers::{Door, Peers};
use crate::pool::Pool;
use crate::routes::{self, Gate};
use crate::serving::within::Within;
use crate::serving::{Load, Serving, Stock};
use crate::session::{House, Shared};
use crate::stats::Stats;
use crate::tls::Tls;
use crate::{http, memory, publish};

/// How long sessions have to say goodbye when the server stops, and after them what else is asked for. Together well below the ten seconds that who stops a
/// server may count on.
const SESSIONS_LEAVE_WITHIN: Duration = Duration::from_secs(5);
const REQUESTS_END_WITHIN: Duration = Duration::from_secs(2);

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
    serving: Arc<Serving>,
    house: House,
    places: usize,
    limits: SceneLimits,
    stop: watch::Sender<bool>,
    task: JoinHandle<()>,
}

/// How many are there, for who keeps servers.
#[derive(Clone)]
pub struct Attendance {
    serving: Arc<Serving>,
    house: House,
    places: usize,
}

impl Attendance {
    /// Sessions now: of clients that have greeted; `None` while nobody may come.
    pub fn sessions(&self) -> Option<usize> {
        self.serving
            .open(None, &Within::default())
            .ok()
            .map(|_| self.places.saturating_sub(self.house.places.available_permits()))
    }
}

/// A server that runs in the background until it is stopped. Dropping it leaves it running.
pub struct Running {
    /// Where it listens.
    pub addr: SocketAddr,
    /// What it counts.
    pub stats: Arc<Stats>,
    url: String,
    stop: watch::Sender<bool>,
    serving: Arc<Serving>,
    house: House,
    places: u32,
    tasks: [JoinHandle<()>; 2],
}

/// A port that answers.
pub(crate) struct Answering {
    pub addr: SocketAddr,
    pub url: String,
    pub stop: watch::Sender<bool>,
    pub task: JoinHandle<()>,
}

/// Listens, as the options of a server say that are about its port, for what is there behind it.
pub(crate) async fn listen_for(config: &Config, host: Arc<dyn Host>) -> Result<Answering, ServeError> {
    let addr = SocketAddr::new(config.bind, config.port);
    let listen_error = |source| ServeError::Listen { addr, source };
    let listener = TcpListener::bind(addr).await.map_err(listen_error)?;
    let addr = listener.local_addr().map_err(listen_error)?;
    let (stop, stopped) = watch::channel(false);
    let peers = Arc::new(Peers::new(&config.limits, &config.access.proxies));
    let door = Door::new(listener, peers.clone(), config.tls.is_some());
    let gate = Arc::new(Gate::new(config, host, peers));
    let scheme = if config.tls.is_some() { "https" } else { "http" };
    let task = answers(door, routes::router(gate, config), config.tls.clone(), stopped);
    Ok(Answering { addr, url: format!("{scheme}://{addr}"), stop, task })
}

/// Has a task answer who comes to the door. No part of an asynchronous function: all that tasks run which begin within one is compiled by each program that calls it, once more.
fn answers(door: Door, router: Router, tls: Option<Tls>, stopped: watch::Receiver<bool>) -> JoinHandle<()> {
    match tls {
        None => tokio::spawn(http::answer(door, router, stopped)),
        Some(tls) => tokio::spawn(http::answer(tls.listen(door), router, stopped)),
    }
}

/// The same for a server whose scene is still to be loaded.
pub async fn listen(config: &Config) -> Result<Listening, ServeError> {
    let serving = Arc::<Serving>::default();
    let Answering { addr, url, stop, task } = listen_for(config, serving.clone()).await?;
    let places = config.limits.clients;
    Ok(Listening {
        addr,
        url,
        serving,
        house: House::new(&config.limits),
        places,
        limits: config.limits.scenes,
        stop,
        task,
    })
}

impl Listening {
    /// Where a browser finds it.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Tells how many are there, from now on.
    pub fn attendance(&self) -> Attendance {
        Attendance { serving: self.serving.clone(), house: self.house.clone(), places: self.places }
    }

    /// What is shown to who comes: how far the scene is.
    pub fn progress(&self) -> impl Fn(String) + Send + Sync + 'static {
        let serving = self.serving.clone();
        move |said| serving.says(said)
    }

    /// Offers further scenes beside it, each to who names it. `load` makes one ready; `first`: what the scene that is served is called in their folder.
    pub fn offer(&self, stock: impl Into<Stock>, first: Option<String>, load: Load) {
        self.offer_stock(stock.into(), first, load);
    }

    fn offer_stock(&self, stock: Stock, first: Option<String>, load: Load) {
        tokio::spawn(self.serving.clone().offer(stock, first, load, (self.limits, self.house.clone())));
    }

    /// Serves a scene from now on. The imager must have been made for it, and `config` must be that which it listens by.
    pub fn serve(self, config: Config, scene: Arc<Scene>, imager: Box<dyn Imager>) -> Result<Running, ServeError> {
        let Listening { addr, url, serving, house, places, stop, task, .. } = self;
        let give_back = tokio::spawn(memory::give_back_after(house.ended.clone()));
        let (stats, places) = (house.stats.clone(), u32::try_from(places).unwrap_or(u32::MAX));
        let running = Running { addr, stats, url, stop, serving, house, places, tasks: [task, give_back] };
        running.show(config, scene, imager)?;
        Ok(running)
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

    /// Serves another scene to new sessions, and tells those of the one before to come again; as [`Listening::serve`].
    pub fn show(&self, config: Config, scene: Arc<Scene>, imager: Box<dyn Imager>) -> Result<(), ServeError> {
        let published = config.publish.clone();
        let shared = Shared::open(config, scene, imager, self.house.clone()).map_err(ServeError::Thread)?;
        if let Some(broker) = published {
            tokio::spawn(publish::run(shared.clone(), broker));
        }
        self.serving.show(shared);
        Ok(())
    }

    /// Has the scenes of the folder that are open loaded anew, one after the other. One that cannot be stays as it is.
    pub fn reload_others(&self) {
        self.serving.reload_others();
    }

    /// What was drawn of the scene that is shown, and what did not have to be.
    pub fn pool(&self) -> Option<Arc<Pool>> {
        self.serving.shared().ok().map(|shared| shared.pool.clone())
    }

    /// Lets nobody in any more, which `/readyz` says, and tells every client goodbye.
    pub fn drain(&self) {
        self.serving.drain();
    }

    /// Says goodbye to every client and stops. Until all have gone it answers, so that whoever asks is told.
    pub async fn stop(self) {
        self.drain();
        let left = self.house.places.acquire_many(self.places);
        if tokio::time::timeout(SESSIONS_LEAVE_WITHIN, left).await.is_err() {
            tracing::warn!("some clients did not take the goodbye in time");
        }
        self.stop.send_replace(true);
        let [answers, give_back] = self.tasks;
        if tokio::time::timeout(REQUESTS_END_WITHIN, answers).await.is_err() {
            tracing::warn!("some requests did not end in time");
        }
        give_back.abort();
    }

    /// Waits until the server can make no more images, and says why. For a process that lives as long as its server.
    pub async fn failed(&self) -> String {
        self.serving.failed().await
    }
}
