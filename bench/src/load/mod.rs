//! Many clients of one server, without drawing: each does what a script says, decodes and acknowledges what it gets, and
//! measures how long that took.
//!
//! - [`Script`]: what clients do; `client` comes and goes by it, `visit` is one connection.
//! - [`Limits`]: what a run must keep to.
//! - [`text`], [`page`] and JSON show a [`Report`]: its figures, and the run second by second.

mod client;
mod files;
mod health;
mod limits;
mod page;
mod paths;
mod percentiles;
mod quality;
mod report;
mod script;
mod series;
mod stay;
mod table;
#[cfg(test)]
mod tests;
mod visit;
mod watch;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use anyhow::Context;
use camera::Trace;
use protocol::message::Clock;
use tokio::runtime::Runtime;
use tokio::sync::Notify;

pub use client::ClientReport;
use client::{Client, Shared};
pub use files::{TooFewFiles, allow as allow_files};
use health::{websocket_url, without_token};
pub use limits::{Limits, NoTime, missed, time};
pub use page::page;
pub use paths::Path;
pub use percentiles::Percentiles;
pub use quality::CLIENTS as LOOKED_AT;
pub use report::{Memory, Report};
pub use script::{Behaviour, Script, ScriptError};
pub use series::{Second, Timed};
pub use table::text;
use watch::Cost;

/// What a run is told.
#[derive(Debug, Clone)]
pub struct Load {
    /// `ws://HOST:PORT`, with or without a path and a query.
    pub server: String,
    /// How many clients.
    pub clients: usize,
    /// How long.
    pub duration: Duration,
    /// Whether a terminal is told how far the run is.
    pub tells_progress: bool,
    /// Over how long they come, evenly; all stay to the end.
    pub ramp: Duration,
    /// Traces to walk, in turn; empty: eight made paths.
    pub traces: Vec<PathBuf>,
    /// What the clients do.
    pub script: Script,
    /// Which clock the server runs.
    pub clock: Clock,
    /// Whether the first client presents and all others follow it.
    pub audience: bool,
    /// Where the followers of an audience connect, in turn; none: where the presenter does.
    pub followed_at: Vec<String>,
    /// So many clients decode what they get, the others only acknowledge it; `None`: all, of an audience the first six.
    pub decoding: Option<usize>,
    /// The still scene that the server shows, where pictures of what clients held are to be compared with it.
    pub scene: Option<String>,
    /// What the run must keep to.
    pub limits: Limits,
}

/// What the names of the load's threads begin with.
pub const THREADS: &str = "load";
/// Sockets of thousands of clients need no more threads, and the server gets the other cores.
const MAX_SOCKET_THREADS: usize = 4;
/// The presenter and five followers.
const DECODING_OF_AUDIENCE: usize = 6;

/// Few threads for the sockets of all clients, and few that decode.
pub fn runtime() -> anyhow::Result<Runtime> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    tokio::runtime::Builder::new_multi_thread()
        .thread_name(THREADS)
        .worker_threads(cores.min(MAX_SOCKET_THREADS))
        .max_blocking_threads(cores)
        .enable_all()
        .build()
        .context("no threads for the load")
}

/// Runs the clients to their end.
pub async fn run(load: &Load) -> anyhow::Result<Report> {
    let behaviours = load.script.behaviours(load.clients);
    if let Some(real) = behaviours.iter().find(|behaviour| load.clock == Clock::Virtual && behaviour.is_of_real_time())
    {
        anyhow::bail!("{} goes by real time, and the clock is virtual", real.name());
    }
    let scene = load.scene.as_deref().map(|name| quality::still_scene(name, load.clock)).transpose()?;
    files::allow(load.clients)?;
    let before = Cost::now(&load.server).await;
    let shared = Arc::new(shared(load)?);
    let come = behaviours.into_iter().enumerate().map(|(index, behaviour)| {
        let comes_s = load.ramp.as_secs_f64() * index as f64 / load.clients as f64;
        let client = Client { index, behaviour, comes_s, ends_s: load.duration.as_secs_f64() };
        tokio::spawn(stay::run(shared.clone(), client))
    });
    let clients: Vec<_> = come.collect();
    let looking = tokio::spawn(watch::look_on(shared.clone(), load.tells_progress.then_some(load.duration)));
    // Near the end everybody holds a set and is being served.
    tokio::time::sleep(load.duration.mul_f64(0.9)).await;
    let during = Cost::now(&load.server).await;
    let mut reports = Vec::new();
    for client in clients {
        reports.push(client.await.context("a client task failed")?);
    }
    shared.is_over.notify_one();
    let counts = looking.await.context("looking on failed")?;
    let mut report = Report {
        script: load.script.to_string(),
        server: without_token(&load.server),
        welcome: shared.welcome.get().cloned(),
        seconds: shared.now_s(),
        ..Report::of(reports)
    };
    report.tell_costs(&before, during);
    report.tell_seconds(&counts);
    report.bars = load.limits.bars(&report);
    if let Some(scene) = scene {
        let moments = report.clients.iter_mut().flat_map(|client| std::mem::take(&mut client.moments)).collect();
        let drawn = move || quality::flip_covered(scene, visit::VIEW.fov_y_rad, moments);
        report.flip_covered = tokio::task::spawn_blocking(drawn).await.context("drawing failed")??;
    }
    Ok(report)
}

fn shared(load: &Load) -> anyhow::Result<Shared> {
    let usual = if load.audience { DECODING_OF_AUDIENCE } else { load.clients };
    Ok(Shared {
        url: websocket_url(&load.server),
        followed_at: load.followed_at.iter().map(|server| websocket_url(server)).collect(),
        digests: Mutex::default(),
        traces: load.traces.iter().map(|path| read_trace(path)).collect::<anyhow::Result<_>>()?,
        clock: load.clock,
        started: Instant::now(),
        keeps_moments: load.scene.is_some(),
        counters: Arc::default(),
        audience: load.audience.then(|| format!("load test {}", std::process::id())),
        decoding: load.decoding.unwrap_or(usual),
        welcome: OnceLock::new(),
        is_over: Notify::new(),
    })
}

fn read_trace(path: &std::path::Path) -> anyhow::Result<Trace> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    Trace::parse(&text).with_context(|| path.display().to_string())
}
