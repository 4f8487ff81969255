//! Peers that harm: each kind goes on for a time, at a pace of its own.
//!
//! They come from addresses of their own, all of which are this machine: one each, or for floods of connections many.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context;
use futures_util::{SinkExt, StreamExt};
use protocol::message::{ClientMessage, Clock, ViewSize};
use protocol::session::{ClientConfig, ClientSession};
use protocol::wire::{Envelope, encode_client};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{WebSocketStream, client_async};

use crate::rng::Rng;

/// What a hostile peer does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Greets, walks nowhere, and reads nothing any more.
    Stalls,
    /// Sends a request byte by byte.
    Drips,
    /// Asks for websockets as nobody may.
    BadHandshakes,
    /// Sends damaged messages.
    BadMessages,
    /// Opens connections from many addresses, and does nothing with them.
    Connections,
}

impl Kind {
    pub const ALL: [Kind; 5] = [Kind::Stalls, Kind::Drips, Kind::BadHandshakes, Kind::BadMessages, Kind::Connections];
}

/// How much of each was done.
#[derive(Debug, Default)]
pub(super) struct Done {
    pub handshakes: AtomicU64,
    pub messages: AtomicU64,
    pub connections: AtomicU64,
    /// Connections that the server ended or turned away.
    pub ended: AtomicU64,
}

/// How much a peer does in a second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    pub handshakes: f64,
    pub messages: f64,
    pub connections: f64,
}

/// Messages of one connection; the first one that is refused ends it.
const MESSAGES: usize = 8;
/// How long idle connections stay.
const STAYS: Duration = Duration::from_secs(2);
const VIEW: ViewSize = ViewSize { width_px: 320, height_px: 180, fov_y_rad: 1.0 };

/// One hostile peer.
pub(super) struct Peer {
    pub to: SocketAddr,
    pub kind: Kind,
    /// Among all of them.
    pub index: usize,
    pub until: Instant,
    pub pace: Pace,
    pub done: Arc<Done>,
}

impl Peer {
    /// Goes on until its time is over; whatever becomes of a connection, there is a next one.
    pub async fn run(self) {
        let mut rng = Rng::new(self.index as u64);
        let each_s = match self.kind {
            Kind::Stalls | Kind::Drips => 1.0,
            Kind::BadHandshakes => 1.0 / self.pace.handshakes,
            Kind::BadMessages => MESSAGES as f64 / self.pace.messages,
            Kind::Connections => 1.0 / self.pace.connections,
        };
        let mut next = tokio::time::interval(Duration::from_secs_f64(each_s));
        let mut idle = Vec::new();
        while Instant::now() < self.until {
            next.tick().await;
            let done = match self.kind {
                Kind::Stalls => self.stalls().await,
                Kind::Drips => self.drips().await,
                Kind::BadHandshakes => self.bad_handshake(&mut rng).await,
                Kind::BadMessages => self.bad_messages(&mut rng).await,
                Kind::Connections => self.connects(&mut rng, &mut idle).await,
            };
            if done.is_err() {
                self.done.ended.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    async fn connect(&self, from: [u8; 4]) -> anyhow::Result<TcpStream> {
        let socket = TcpSocket::new_v4()?;
        socket.set_reuseaddr(true)?;
        socket.bind(SocketAddr::from((Ipv4Addr::from(from), 0)))?;
        self.done.connections.fetch_add(1, Ordering::Relaxed);
        Ok(socket.connect(self.to).await?)
    }

    /// Its own address.
    fn from(&self) -> [u8; 4] {
        [127, 1, (self.index >> 8) as u8, self.index as u8]
    }

    async fn websocket(&self) -> anyhow::Result<WebSocketStream<TcpStream>> {
        let stream = self.connect(self.from()).await?;
        let opening = client_async(format!("ws://{}/ws", self.to), stream);
        Ok(tokio::time::timeout(Duration::from_secs(5), opening).await?.context("not opened")?.0)
    }

    async fn greeted(&self) -> anyhow::Result<WebSocketStream<TcpStream>> {
        let mut socket = self.websocket().await?;
        let mut session = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
        while let Some(bytes) = session.poll_transmit() {
            socket.send(Message::Binary(bytes.into())).await?;
        }
        Ok(socket)
    }

    async fn stalls(&self) -> anyhow::Result<()> {
        let _unread = self.greeted().await?;
        tokio::time::sleep_until(self.until.into()).await;
        Ok(())
    }

    async fn drips(&self) -> anyhow::Result<()> {
        let mut stream = self.connect(self.from()).await?;
        let head = b"GET /ws HTTP/1.1\r\nX-Slow: ";
        for byte in head.iter().chain(std::iter::repeat(&b'a')) {
            if Instant::now() >= self.until {
                break;
            }
            stream.write_all(&[*byte]).await?;
            tokio::time::sleep(Duration::from_millis(300)).await;
        }
        Ok(())
    }

    async fn bad_handshake(&self, rng: &mut Rng) -> anyhow::Result<()> {
        let sound = format!(
            "GET /ws HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
            self.to
        );
        let mut bytes = sound.into_bytes();
        damage(rng, &mut bytes);
        let mut stream = self.connect(self.from()).await?;
        self.done.handshakes.fetch_add(1, Ordering::Relaxed);
        stream.write_all(&bytes).await?;
        stream.shutdown().await?;
        let mut answer = [0; 1024];
        let heard = tokio::time::timeout(STAYS, stream.read(&mut answer)).await;
        heard??;
        Ok(())
    }

    async fn bad_messages(&self, rng: &mut Rng) -> anyhow::Result<()> {
        let mut socket = self.greeted().await?;
        let real =
            [ClientMessage::View(VIEW), ClientMessage::Restart, ClientMessage::Ping(1), ClientMessage::Inventory];
        for _ in 0..MESSAGES {
            let message = real[rng.bits() as usize % real.len()].clone();
            let mut bytes = encode_client(&Envelope { at_s: 0.1, message });
            damage(rng, &mut bytes);
            self.done.messages.fetch_add(1, Ordering::Relaxed);
            socket.send(Message::Binary(bytes.into())).await?;
        }
        // What it is told, until it is hung up on. The next connection need not wait for that.
        let told = async move { while let Some(Ok(_)) = socket.next().await {} };
        tokio::spawn(tokio::time::timeout(STAYS, told));
        Ok(())
    }

    async fn connects(&self, rng: &mut Rng, idle: &mut Vec<(Instant, TcpStream)>) -> anyhow::Result<()> {
        let from = [127, 2, rng.bits() as u8, (rng.bits() as u8).max(1)];
        idle.push((Instant::now() + STAYS, self.connect(from).await?));
        idle.retain(|(until, _)| *until > Instant::now());
        Ok(())
    }
}

/// Changes some bytes, cuts or adds some.
fn damage(rng: &mut Rng, bytes: &mut Vec<u8>) {
    for _ in 0..=rng.bits() % 3 {
        let place = rng.bits() as usize % bytes.len().max(1);
        match rng.bits() % 4 {
            0 => bytes.truncate(place),
            1 => bytes.extend((0..rng.bits() % 40).map(|_| rng.bits() as u8).collect::<Vec<_>>()),
            2 => bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte = rng.bits() as u8),
            _ => bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << (rng.bits() % 8)),
        }
    }
}
