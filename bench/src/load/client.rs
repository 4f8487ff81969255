//! One client: moves, decodes, acknowledges, measures.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use camera::{Motion, Trace};
use futures_util::{SinkExt, StreamExt};
use protocol::Held;
use protocol::limits::Limits;
use protocol::message::{Clock, Role, ViewSize};
use protocol::session::{ClientConfig, ClientEvent, ClientSession, ReceivedUpdate};
use protocol::wire::decode_update;
use serde::Serialize;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use super::paths::Path;
use super::quality::{self, Moment};

/// Poses a second: what a viewer of 30 frames a second sends.
const POSE_INTERVAL: Duration = Duration::from_millis(33);
/// What a client pretends to draw.
pub(super) const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: std::f64::consts::FRAC_PI_3 };
/// A stalling client reads this much of its time: the connection is sound before it stops.
const STALLS_AFTER: f64 = 0.25;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// Whether a client goes on reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// To the end.
    Reads,
    /// Stops after a quarter of its time, and moves on.
    Stalls,
}

/// What all clients of a run share.
pub struct Shared {
    /// Of the websocket.
    pub url: String,
    /// Empty: made paths.
    pub traces: Vec<Trace>,
    /// Which clock the server runs.
    pub clock: Clock,
    /// Time 0 of everything.
    pub started: Instant,
    /// Whether what the first clients hold is kept at moments, to be drawn.
    pub keeps_moments: bool,
    /// Clients that run now, and updates that all of them held so far.
    pub running: AtomicUsize,
    /// See `running`.
    pub updates: AtomicU64,
    /// The name by which the first client presents and all others follow; `None` where each goes his own way.
    pub audience: Option<String>,
}

/// So many followers decode what they get; the others acknowledge it by what its head says, which is what their server sees of it.
const DECODING_FOLLOWERS: usize = 5;

impl Shared {
    fn role(&self, index: usize) -> Role {
        match &self.audience {
            None => Role::Viewer,
            Some(name) if index == 0 => Role::Presenter(name.clone()),
            Some(name) => Role::Follower(name.clone()),
        }
    }

    fn decodes(&self, index: usize) -> bool {
        self.audience.is_none() || index <= DECODING_FOLLOWERS
    }
}

/// What one client saw.
#[derive(Debug, Serialize)]
pub struct ClientReport {
    /// From 0.
    pub index: usize,
    /// Whether it read to the end.
    pub mode: Mode,
    /// Updates held; of most followers of an audience, acknowledged.
    pub updates: u64,
    /// Bytes received, without the transport's own.
    pub bytes: u64,
    /// Samples held at the end.
    pub held_samples: usize,
    /// Pose sent to its update decoded; one value a pose that an update answered.
    #[serde(skip)]
    pub latencies_ms: Vec<f64>,
    /// From the server's stamp of an update to its last byte here, by the clock that pings agree on; on the wall clock.
    #[serde(skip)]
    pub lags_ms: Vec<f64>,
    /// Between updates, the first one's excepted.
    #[serde(skip)]
    pub intervals_ms: Vec<f64>,
    /// What it held now and then, if that was asked for.
    #[serde(skip)]
    pub moments: Vec<Moment>,
    /// Their mean.
    pub mean_interval_ms: f64,
    /// Their longest.
    pub max_interval_ms: f64,
    /// Why it ended early.
    pub error: Option<String>,
}

impl ClientReport {
    /// The longest interval by the mean one; not a number with fewer than two intervals.
    pub fn longest_interval_by_mean(&self) -> f64 {
        if self.intervals_ms.len() < 2 { f64::NAN } else { self.max_interval_ms / self.mean_interval_ms }
    }
}

/// Runs one client for a time, once a time has passed; a failure is part of its report.
pub async fn run(shared: Arc<Shared>, index: usize, mode: Mode, after: Duration, duration: Duration) -> ClientReport {
    tokio::time::sleep(after).await;
    shared.running.fetch_add(1, Ordering::Relaxed);
    let begun_s = if shared.clock == Clock::Virtual { 0.0 } else { shared.started.elapsed().as_secs_f64() };
    let mut client = Client {
        session: ClientSession::new(
            ClientConfig { role: shared.role(index), ..ClientConfig::new(shared.clock, VIEW) },
            begun_s,
        ),
        shared,
        index,
        held: Held::default(),
        sent: VecDeque::new(),
        updated_at_s: None,
        path: None,
        virtual_s: 0.0,
        updates: 0,
        latencies_ms: Vec::new(),
        lags_ms: Vec::new(),
        intervals_ms: Vec::new(),
        moments: Vec::new(),
    };
    let result = match client.shared.clock {
        Clock::Wall => client.run(mode, duration).await,
        Clock::Virtual => client.run_virtual(duration.as_secs_f64()).await,
    };
    client.shared.running.fetch_sub(1, Ordering::Relaxed);
    let intervals = &client.intervals_ms;
    ClientReport {
        index,
        mode,
        updates: client.updates,
        bytes: client.session.bytes_received_and_sent().0,
        held_samples: client.held.sample_count(),
        mean_interval_ms: intervals.iter().sum::<f64>() / intervals.len() as f64,
        max_interval_ms: intervals.iter().copied().fold(f64::NAN, f64::max),
        latencies_ms: client.latencies_ms,
        lags_ms: client.lags_ms,
        intervals_ms: client.intervals_ms,
        moments: client.moments,
        error: result.err().map(|error| format!("{error:#}")),
    }
}

struct Client {
    shared: Arc<Shared>,
    index: usize,
    session: ClientSession,
    held: Held,
    /// Poses that no update answered yet: number and time.
    sent: VecDeque<(u64, f64)>,
    updated_at_s: Option<f64>,
    path: Option<Path>,
    virtual_s: f64,
    updates: u64,
    latencies_ms: Vec<f64>,
    lags_ms: Vec<f64>,
    intervals_ms: Vec<f64>,
    moments: Vec<Moment>,
}

impl Client {
    async fn run(&mut self, mode: Mode, duration: Duration) -> anyhow::Result<()> {
        let (mut socket, _) = connect_async(&self.shared.url).await.context("cannot connect")?;
        let begun = Instant::now();
        let mut poses = tokio::time::interval(POSE_INTERVAL);
        poses.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        while begun.elapsed() < duration {
            let reads = mode == Mode::Reads || begun.elapsed() < duration.mul_f64(STALLS_AFTER);
            tokio::select! {
                message = socket.next(), if reads => match message {
                    Some(Ok(Message::Binary(bytes))) => self.session.handle(&bytes, self.now_s())?,
                    Some(Ok(Message::Close(_))) | None => bail!("the server closed the connection"),
                    Some(Ok(_)) => {}
                    Some(Err(error)) => return Err(error).context("the connection broke"),
                },
                _ = poses.tick() => {
                    self.pose();
                    self.keep_moment(begun.elapsed().as_secs_f64() / duration.as_secs_f64());
                }
            }
            let now_s = self.now_s();
            if reads {
                self.session.handle_timeout(now_s)?;
            }
            self.events().await?;
            self.flush(&mut socket).await?;
        }
        // The server has its word when it looks; a socket that is just dropped is a client that vanished.
        drop(tokio::time::timeout(Duration::from_secs(1), socket.close(None)).await);
        Ok(())
    }

    /// The same in steps of virtual time, without network delay.
    async fn run_virtual(&mut self, duration_s: f64) -> anyhow::Result<()> {
        let (mut socket, _) = connect_async(&self.shared.url).await.context("cannot connect")?;
        let mut step = 0_u32;
        while self.virtual_s < duration_s {
            self.virtual_s = f64::from(step) * POSE_INTERVAL.as_secs_f64();
            step += 1;
            self.pose();
            self.session.advance(self.virtual_s);
            self.flush(&mut socket).await?;
            let mut advanced = false;
            while !advanced {
                let Some(message) = socket.next().await else { bail!("the server closed the connection") };
                if let Message::Binary(bytes) = message.context("the connection broke")? {
                    self.session.receive_virtual(bytes.into(), |sent_at_s, _| sent_at_s)?;
                }
                advanced = self.events().await?;
            }
            self.session.run_until(self.virtual_s)?;
            self.events().await?;
            self.flush(&mut socket).await?;
        }
        Ok(())
    }

    /// Takes in what happened; whether a step of virtual time ended.
    async fn events(&mut self) -> anyhow::Result<bool> {
        let mut advanced = false;
        while let Some(event) = self.session.poll_event() {
            match event {
                ClientEvent::Welcome(welcome) => self.path = Some(self.choose_path(&welcome)),
                ClientEvent::Update(received) => self.update(received).await?,
                ClientEvent::Presenter(_) => {}
                ClientEvent::Advanced { .. } => advanced = true,
            }
        }
        Ok(advanced)
    }

    async fn flush(&mut self, socket: &mut Socket) -> anyhow::Result<()> {
        while let Some(bytes) = self.session.poll_transmit() {
            socket.send(Message::Binary(bytes.into())).await.context("the connection broke")?;
        }
        Ok(())
    }

    fn now_s(&self) -> f64 {
        if self.shared.clock == Clock::Virtual {
            return self.virtual_s;
        }
        self.shared.started.elapsed().as_secs_f64()
    }

    fn choose_path(&self, welcome: &protocol::message::Welcome) -> Path {
        match self.shared.traces.len() {
            0 => Path::made(welcome, self.index),
            count => {
                let trace = self.shared.traces[self.index % count].clone();
                // Clients on one trace are spread over it.
                let offset_s = trace.duration_s() * (self.index / count) as f64 * 0.37;
                Path::Trace(trace, offset_s)
            }
        }
    }

    fn pose(&mut self) {
        let now_s = self.now_s();
        let Some(path) = self.path.as_ref().filter(|_| self.shared.role(self.index).is_asking()) else { return };
        let before = self.session.pose_seq();
        self.session.set_pose(path.at(now_s), Motion::along(path.velocity_world(now_s)), now_s);
        if self.session.pose_seq() > before {
            self.sent.push_back((self.session.pose_seq(), now_s));
        }
    }

    /// Keeps what is held where a moment of the run has come.
    fn keep_moment(&mut self, share: f64) {
        let is_due = quality::AT.get(self.moments.len()).is_some_and(|at| share >= *at);
        if let (true, Some(path)) = (is_due && self.shared.keeps_moments && self.index < quality::CLIENTS, &self.path) {
            self.moments.push(Moment { held: self.held.clone(), world_from_eye: path.at(self.now_s()) });
        }
    }

    async fn update(&mut self, received: ReceivedUpdate) -> anyhow::Result<()> {
        let head = received.head;
        if let Some(clock) = self.session.scene_clock().filter(|_| self.shared.clock == Clock::Wall) {
            // In real time scene time is the server's.
            self.lags_ms.push((clock.scene_time_s(received.arrived_at_s) - received.sent_at_s) * 1e3);
        }
        if self.shared.decodes(self.index) {
            self.decode(received).await?;
        }
        let now_s = self.now_s();
        self.session.applied(head.number, head.digest, now_s);
        self.updates += 1;
        self.shared.updates.fetch_add(1, Ordering::Relaxed);
        if let Some(before_s) = self.updated_at_s.replace(now_s) {
            self.intervals_ms.push((now_s - before_s) * 1000.0);
        }
        while let Some((seq, sent_at_s)) = self.sent.pop_front_if(|(seq, _)| *seq <= head.pose_seq) {
            if seq == head.pose_seq {
                self.latencies_ms.push((now_s - sent_at_s) * 1000.0);
            }
        }
        Ok(())
    }

    /// Decodes an update and holds what it says, which fails where its digest does not come out.
    async fn decode(&mut self, received: ReceivedUpdate) -> anyhow::Result<()> {
        let mut held = std::mem::take(&mut self.held);
        // Decoding takes milliseconds: not on a thread that other clients' sockets wait for.
        self.held = tokio::task::spawn_blocking(move || -> anyhow::Result<_> {
            let update = decode_update(&received.bytes, &Limits::default())?;
            held.apply(&update)?;
            Ok(held)
        })
        .await
        .context("decoding failed")??;
        Ok(())
    }
}
