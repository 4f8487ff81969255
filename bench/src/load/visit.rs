//! One visit of a client: from connecting to leaving it moves, decodes, acknowledges and measures.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::{Context, bail};
use camera::Motion;
use futures_util::{SinkExt, StreamExt};
use protocol::Held;
use protocol::limits::Limits;
use protocol::message::{Clock, ViewSize, Welcome};
use protocol::session::{ClientConfig, ClientEvent, ClientSession, ReceivedUpdate};
use protocol::wire::decode_update;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use super::client::{Client, ClientReport, Shared};
use super::paths::Path;
use super::quality::{self, Moment};
use super::script::Behaviour;
use super::series::{Connected, Timed};

/// Poses a second: what a viewer of 30 frames a second sends.
const POSE_INTERVAL_S: f64 = 0.033;
/// What a client pretends to draw.
pub(super) const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: std::f64::consts::FRAC_PI_3 };
/// How long a server may take to let somebody in.
const CONNECTS_WITHIN: Duration = Duration::from_secs(15);
/// What a socket reads at once. The usual 128 KiB would be most of what a client takes.
const READ_BYTES: usize = 8 << 10;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// How a visit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Left {
    /// The time is over.
    AtEnd,
    /// Without a word, to come back.
    InStorm,
}

pub(super) struct Visit<'a> {
    shared: &'a Shared,
    client: Client,
    seen: &'a mut ClientReport,
    session: ClientSession,
    held: Held,
    /// Of the last update.
    number: Option<u64>,
    /// Poses that no update answered yet: number and time.
    sent: VecDeque<(u64, f64)>,
    updated_at_s: Option<f64>,
    path: Option<Path>,
    connected_at_s: f64,
    virtual_s: f64,
}

impl<'a> Visit<'a> {
    /// From connecting to leaving; what is seen is added to the client's report.
    pub async fn run(shared: &'a Shared, client: Client, seen: &'a mut ClientReport) -> anyhow::Result<Left> {
        let mut socket = connect(shared.url(client.index)).await?;
        let _connected = Connected::count(&shared.counters);
        shared.counters.reconnections.fetch_add(u64::from(seen.reconnections > 0), Ordering::Relaxed);
        let now_s = if shared.clock == Clock::Virtual { 0.0 } else { shared.now_s() };
        let config = ClientConfig { role: shared.role(client.index), ..ClientConfig::new(shared.clock, VIEW) };
        let mut visit = Visit {
            shared,
            client,
            seen,
            session: ClientSession::new(config, now_s),
            held: Held::default(),
            number: None,
            sent: VecDeque::new(),
            updated_at_s: None,
            path: None,
            connected_at_s: now_s,
            virtual_s: 0.0,
        };
        let left = match shared.clock {
            Clock::Wall => visit.in_real_time(&mut socket).await,
            Clock::Virtual => visit.in_virtual_time(&mut socket).await.map(|()| Left::AtEnd),
        };
        visit.seen.held_samples = visit.held.sample_count();
        if left.as_ref().is_ok_and(|left| *left == Left::AtEnd) {
            // The server has its word when it looks; a socket that is just dropped is a client that vanished.
            drop(timeout(Duration::from_secs(1), socket.close(None)).await);
        }
        left
    }

    async fn in_real_time(&mut self, socket: &mut Socket) -> anyhow::Result<Left> {
        self.flush(socket).await?;
        let mut next_pose_s = self.now_s();
        while self.now_s() < self.client.ends_s {
            let reads = self.client.behaviour.reads(self.now_s());
            tokio::select! {
                message = socket.next(), if reads => match message {
                    Some(Ok(Message::Binary(bytes))) => {
                        self.count(&bytes);
                        self.session.handle(&bytes, self.now_s())?;
                    }
                    Some(Ok(Message::Close(_))) | None => bail!("the server closed the connection"),
                    Some(Ok(_)) => {}
                    Some(Err(error)) => return Err(error).context("the connection broke"),
                },
                () = tokio::time::sleep(self.until_due(next_pose_s)) => {}
            }
            let now_s = self.now_s();
            if self.client.behaviour.leaves(self.connected_at_s, now_s) {
                return Ok(Left::InStorm);
            }
            if self.is_on_the_move() && now_s >= next_pose_s {
                next_pose_s = now_s + POSE_INTERVAL_S;
                self.pose();
                self.keep_moment();
            }
            self.session.handle_timeout(now_s)?;
            self.events().await?;
            self.flush(socket).await?;
        }
        Ok(Left::AtEnd)
    }

    /// The same in steps of virtual time, without network delay.
    async fn in_virtual_time(&mut self, socket: &mut Socket) -> anyhow::Result<()> {
        let duration_s = self.client.ends_s - self.client.comes_s;
        let mut step = 0_u32;
        while self.virtual_s < duration_s {
            self.virtual_s = f64::from(step) * POSE_INTERVAL_S;
            step += 1;
            self.pose();
            self.session.advance(self.virtual_s);
            self.flush(socket).await?;
            let mut advanced = false;
            while !advanced {
                let Some(message) = socket.next().await else { bail!("the server closed the connection") };
                if let Message::Binary(bytes) = message.context("the connection broke")? {
                    self.count(&bytes);
                    self.session.receive_virtual(bytes.into(), |sent_at_s, _| sent_at_s)?;
                }
                advanced = self.events().await?;
            }
            self.session.run_until(self.virtual_s)?;
            self.events().await?;
            self.flush(socket).await?;
        }
        Ok(())
    }

    fn count(&mut self, bytes: &[u8]) {
        self.seen.bytes += bytes.len() as u64;
        self.shared.counters.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
    }

    /// Whether there is something to do at every pose; who stands still sleeps until the session wants something.
    fn is_on_the_move(&self) -> bool {
        !self.client.behaviour.is_still() || self.keeps_moments()
    }

    fn until_due(&self, next_pose_s: f64) -> Duration {
        let pose_s = if self.is_on_the_move() { next_pose_s } else { f64::INFINITY };
        let session_s = self.session.next_deadline_s().unwrap_or(f64::INFINITY);
        let due_s = pose_s.min(session_s).min(self.client.ends_s);
        Duration::from_secs_f64((due_s - self.now_s()).max(0.0))
    }

    /// Takes in what happened; whether a step of virtual time ended.
    async fn events(&mut self) -> anyhow::Result<bool> {
        let mut advanced = false;
        while let Some(event) = self.session.poll_event() {
            match event {
                ClientEvent::Welcome(welcome) => {
                    self.path = Some(self.choose_path(&welcome));
                    self.shared.welcome.get_or_init(|| *welcome);
                    self.pose();
                }
                ClientEvent::Update(received) => self.update(received).await?,
                ClientEvent::Presenter(..) | ClientEvent::Inventory(_) | ClientEvent::Name { .. } => {}
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
        if self.shared.clock == Clock::Virtual { self.virtual_s } else { self.shared.now_s() }
    }

    fn choose_path(&self, welcome: &Welcome) -> Path {
        let index = self.client.index;
        let walked = || match self.shared.traces.len() {
            0 => Path::made(welcome, index),
            count => {
                let trace = self.shared.traces[index % count].clone();
                // Clients on one trace are spread over it.
                let offset_s = trace.duration_s() * (index / count) as f64 * 0.37;
                Path::Trace(trace, offset_s)
            }
        };
        match self.client.behaviour {
            Behaviour::Orbit => Path::orbit(welcome, index),
            Behaviour::Idle => Path::Still(walked().at(0.0)),
            Behaviour::Arrive => Path::Still(welcome.start_world_from_eye),
            Behaviour::Walk | Behaviour::Reconnect | Behaviour::Stall => walked(),
        }
    }

    fn pose(&mut self) {
        let now_s = self.now_s();
        let is_asking = self.shared.role(self.client.index).is_asking();
        let Some(path) = self.path.as_ref().filter(|_| is_asking) else { return };
        let before = self.session.pose_seq();
        self.session.set_pose(path.at(now_s), Motion::along(path.velocity_world(now_s)), now_s);
        if self.session.pose_seq() > before {
            self.sent.push_back((self.session.pose_seq(), now_s));
        }
    }

    fn keeps_moments(&self) -> bool {
        self.shared.keeps_moments && self.client.index < quality::CLIENTS
    }

    /// Keeps what is held where a moment of the run has come.
    fn keep_moment(&mut self) {
        let Client { comes_s, ends_s, .. } = self.client;
        let share = (self.now_s() - comes_s) / (ends_s - comes_s);
        let is_due = quality::AT.get(self.seen.moments.len()).is_some_and(|at| share >= *at);
        if let (true, Some(path)) = (is_due && self.keeps_moments(), &self.path) {
            self.seen.moments.push(Moment { held: self.held.clone(), world_from_eye: path.at(self.now_s()) });
        }
    }

    async fn update(&mut self, received: ReceivedUpdate) -> anyhow::Result<()> {
        let head = received.head;
        let at_s = self.shared.now_s();
        if let Some(clock) = self.session.scene_clock().filter(|_| self.shared.clock == Clock::Wall) {
            // In real time scene time is the server's.
            let ms = (clock.scene_time_s(received.arrived_at_s) - received.sent_at_s) * 1e3;
            self.seen.lags.push(Timed { at_s, ms });
        }
        if self.shared.audience.is_some() {
            let follows = head.clears || self.number.is_none_or(|number| head.number == number + 1);
            self.seen.gaps += u64::from(!follows);
            self.seen.strays += u64::from(!self.shared.is_the_same(head.number, head.digest));
            self.number = Some(head.number);
        }
        if self.client.index < self.shared.decoding {
            self.decode(received).await?;
        }
        let now_s = self.now_s();
        self.session.applied(head.number, head.digest, now_s);
        self.seen.updates += 1;
        self.shared.counters.updates.fetch_add(1, Ordering::Relaxed);
        match self.updated_at_s.replace(now_s) {
            Some(before_s) => self.seen.intervals.push(Timed { at_s, ms: (now_s - before_s) * 1e3 }),
            None => self.seen.first_updates.push(Timed { at_s, ms: (now_s - self.connected_at_s) * 1e3 }),
        }
        while let Some((seq, sent_at_s)) = self.sent.pop_front_if(|(seq, _)| *seq <= head.pose_seq) {
            if seq == head.pose_seq {
                self.seen.latencies.push(Timed { at_s, ms: (now_s - sent_at_s) * 1e3 });
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

async fn connect(url: &str) -> anyhow::Result<Socket> {
    let config = WebSocketConfig::default().read_buffer_size(READ_BYTES);
    let connecting = connect_async_with_config(url, Some(config), true);
    let connected = timeout(CONNECTS_WITHIN, connecting).await;
    let connected = connected.with_context(|| format!("not let in within {} s", CONNECTS_WITHIN.as_secs()))?;
    Ok(connected.context("cannot connect")?.0)
}
