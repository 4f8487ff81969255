//! Many clients of one server, without drawing: each moves on its own path, decodes and acknowledges what it gets, and
//! measures how long that took.

mod client;
mod paths;
mod quality;
mod table;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context;
use camera::Trace;
use protocol::message::Clock;
use serde::Serialize;

use crate::report::progress::Progress;
pub use client::{ClientReport, Mode};
pub use paths::Path;
pub use table::table;

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
    /// Share of the clients that stop reading.
    pub stall: f64,
    /// Which clock the server runs.
    pub clock: Clock,
    /// Whether the first client presents and all others follow it.
    pub audience: bool,
    /// The still scene that the server shows, where pictures of what clients held are to be compared with it.
    pub scene: Option<String>,
}

/// What came of a run.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The server.
    pub server: String,
    /// What its `/healthz` said at the end; null where it could not be asked.
    pub health: serde_json::Value,
    /// How long the clients ran.
    pub seconds: f64,
    /// Updates held or, of most followers of an audience, acknowledged, by all clients that read.
    pub updates: u64,
    /// Bytes received, by all clients that read.
    pub bytes: u64,
    /// From sending a pose to having decoded the update that answers it, all clients that read.
    pub latency_ms: Percentiles,
    /// From the server's stamp of an update to its last byte at the client, all clients that read; on the wall clock.
    pub lag_ms: Percentiles,
    /// Time between two updates, all clients that read.
    pub interval_ms: Percentiles,
    /// The worst client's longest interval by its own mean.
    pub worst_interval_by_mean: f64,
    /// Resident memory of the server when nobody was connected, and its growth a client; where it tells.
    pub server_memory: Option<Memory>,
    /// FLIP over covered pixels of what the first clients held at moments of the run, where the scene is told.
    pub flip_covered: Vec<f64>,
    /// How many clients ended by an error.
    pub errors: usize,
    /// Every client.
    pub clients: Vec<ClientReport>,
}

/// Of a measure in milliseconds.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Percentiles {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Worst.
    pub max: f64,
}

impl Percentiles {
    fn of(mut values_ms: Vec<f64>) -> Percentiles {
        values_ms.sort_by(f64::total_cmp);
        let count = values_ms.len();
        let at = |share: f64| match count {
            0 => f64::NAN,
            count => values_ms[((share * count as f64).ceil() as usize).clamp(1, count) - 1],
        };
        let mean = values_ms.iter().sum::<f64>() / count as f64;
        Percentiles { mean, p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

/// Memory of the server.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Memory {
    /// Before the clients came.
    pub before_bytes: u64,
    /// While all were served.
    pub during_bytes: u64,
    /// The difference by the number of clients.
    pub per_client_bytes: u64,
}

/// Runs the clients to their end.
pub async fn run(load: &Load) -> anyhow::Result<Report> {
    let traces: Vec<Trace> = load.traces.iter().map(|path| read_trace(path)).collect::<anyhow::Result<_>>()?;
    let scene = load.scene.as_deref().map(|name| quality::still_scene(name, load.clock)).transpose()?;
    let before = health(&load.server).await;
    let started = Instant::now();
    let shared = Arc::new(client::Shared {
        url: websocket_url(&load.server),
        traces,
        clock: load.clock,
        started,
        keeps_moments: load.scene.is_some(),
        running: AtomicUsize::new(0),
        updates: AtomicU64::new(0),
        audience: load.audience.then(|| format!("load test {}", std::process::id())),
    });
    let stalled = (load.stall * load.clients as f64).ceil() as usize;
    let clients: Vec<_> = (0..load.clients)
        .map(|index| {
            let mode = if index < stalled { Mode::Stalls } else { Mode::Reads };
            let after = load.ramp.mul_f64(index as f64 / load.clients as f64);
            tokio::spawn(client::run(shared.clone(), index, mode, after, load.duration.saturating_sub(after)))
        })
        .collect();
    let progress = load.tells_progress.then(|| tokio::spawn(tell_progress(shared.clone(), load.duration)));
    // Near the end everybody holds a set and is being served.
    tokio::time::sleep(load.duration.mul_f64(0.9)).await;
    let during = health(&load.server).await;
    let mut reports = Vec::new();
    for client in clients {
        reports.push(client.await.context("a client task failed")?);
    }
    progress.iter().for_each(tokio::task::JoinHandle::abort);
    let seconds = started.elapsed().as_secs_f64();
    let mut report = report(load, reports, &before, during, seconds);
    if let Some(scene) = scene {
        let moments = report.clients.iter_mut().flat_map(|client| std::mem::take(&mut client.moments)).collect();
        let drawn = move || quality::flip_covered(scene, client::VIEW.fov_y_rad, moments);
        report.flip_covered = tokio::task::spawn_blocking(drawn).await.context("drawing failed")??;
    }
    Ok(report)
}

/// Tells on a terminal how far the run is.
async fn tell_progress(shared: Arc<client::Shared>, duration: Duration) {
    let progress = Progress::new("load", duration.as_secs());
    loop {
        let before = shared.updates.load(Ordering::Relaxed);
        tokio::time::sleep(Duration::from_secs(1)).await;
        let (running, updates) = (shared.running.load(Ordering::Relaxed), shared.updates.load(Ordering::Relaxed));
        progress.say(format!("{running} clients, {} updates a second", updates - before));
        progress.step();
    }
}

fn report(
    load: &Load,
    clients: Vec<ClientReport>,
    before: &serde_json::Value,
    during: serde_json::Value,
    seconds: f64,
) -> Report {
    let readers = || clients.iter().filter(|client| client.mode == Mode::Reads);
    let resident = |health: &serde_json::Value| health["resident_bytes"].as_u64();
    let server_memory = resident(before).zip(resident(&during)).map(|(before_bytes, during_bytes)| Memory {
        before_bytes,
        during_bytes,
        per_client_bytes: during_bytes.saturating_sub(before_bytes) / load.clients.max(1) as u64,
    });
    Report {
        server: load.server.clone(),
        health: during,
        seconds,
        updates: readers().map(|client| client.updates).sum(),
        bytes: readers().map(|client| client.bytes).sum(),
        latency_ms: Percentiles::of(readers().flat_map(|client| client.latencies_ms.iter().copied()).collect()),
        lag_ms: Percentiles::of(readers().flat_map(|client| client.lags_ms.iter().copied()).collect()),
        interval_ms: Percentiles::of(readers().flat_map(|client| client.intervals_ms.iter().copied()).collect()),
        worst_interval_by_mean: readers().map(ClientReport::longest_interval_by_mean).fold(f64::NAN, f64::max),
        server_memory,
        flip_covered: Vec::new(),
        errors: readers().filter(|client| client.error.is_some()).count(),
        clients,
    }
}

fn read_trace(path: &std::path::Path) -> anyhow::Result<Trace> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    Trace::parse(&text).with_context(|| path.display().to_string())
}

/// The address of the websocket: `/ws` where no path is given.
fn websocket_url(server: &str) -> String {
    let after_scheme = server.find("://").map_or(0, |at| at + 3);
    let (address, query) = match server.find('?') {
        Some(at) => server.split_at(at),
        None => (server, ""),
    };
    let bare = !address[after_scheme.min(address.len())..].trim_end_matches('/').contains('/');
    if bare { format!("{}/ws{query}", address.trim_end_matches('/')) } else { server.to_owned() }
}

/// What the server says of itself; null where it does not.
async fn health(server: &str) -> serde_json::Value {
    tokio::time::timeout(Duration::from_secs(5), ask_health(server)).await.ok().and_then(Result::ok).unwrap_or_default()
}

/// One request over plain HTTP, which needs no client library. A server behind TLS is not asked.
async fn ask_health(server: &str) -> anyhow::Result<serde_json::Value> {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    const MAX_ANSWER_BYTES: u64 = 64 * 1024;
    let address = server.strip_prefix("ws://").context("not plain")?;
    let authority = address.split(['/', '?']).next().unwrap_or(address);
    let target = if authority.contains(':') { authority.to_owned() } else { format!("{authority}:80") };
    let mut stream = tokio::net::TcpStream::connect(target).await?;
    let request = format!("GET /healthz HTTP/1.0\r\nHost: {authority}\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut answer = Vec::new();
    stream.take(MAX_ANSWER_BYTES).read_to_end(&mut answer).await?;
    let answer = String::from_utf8_lossy(&answer);
    let (_, body) = answer.split_once("\r\n\r\n").context("no body")?;
    Ok(serde_json::from_str(body)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_websocket_is_found_at_its_usual_place() {
        assert_eq!(websocket_url("ws://127.0.0.1:8080"), "ws://127.0.0.1:8080/ws");
        assert_eq!(websocket_url("ws://host/"), "ws://host/ws");
        assert_eq!(websocket_url("ws://host?token=a"), "ws://host/ws?token=a");
        assert_eq!(websocket_url("ws://host/other?token=a"), "ws://host/other?token=a");
    }

    #[test]
    fn percentiles_are_of_the_values() {
        let of = Percentiles::of((1..=100).rev().map(f64::from).collect());
        assert_eq!((of.p50, of.p99, of.max, of.mean), (50.0, 99.0, 100.0, 50.5));
        assert!(Percentiles::of(Vec::new()).p99.is_nan());
    }
}
