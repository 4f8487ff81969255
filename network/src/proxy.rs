//! A TCP proxy on loopback that applies a [`Link`] on the wall clock.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, watch};
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::Instant;
use tracing::{debug, warn};

use crate::{Link, LinkModel};

/// Bytes forwarded together: a few packets, so that the bandwidth's pace is smooth.
const CHUNK_BYTES: usize = 8 * 1024;
/// Bytes that a path without a bandwidth holds at most.
const UNLIMITED_HOLDS_BYTES: usize = 8 << 20;
/// How long a queue a path with a bandwidth has, beyond what is on its way: a home router's.
const QUEUE_S: f64 = 0.2;
/// Queue of the slowest path.
const MIN_HOLDS_BYTES: usize = 64 * 1024;
/// The kernel's own buffers: small, so that back-pressure reaches the sender.
const SOCKET_BUFFER_BYTES: u32 = 64 * 1024;
const BACKLOG: u32 = 1024;

/// Forwards every connection to a target, each through a link of its own, both ways. The link's time begins with the proxy. Bytes are kept as they are and in
/// order; what the link holds is bounded, so a receiver that does not read stops its sender. Ends when dropped.
#[derive(Debug)]
pub struct Proxy {
    local_addr: SocketAddr,
    commands: watch::Sender<u64>,
    forwarded: Forwarded,
    accepting: JoinHandle<()>,
}

/// Bytes of all connections so far: to the target, and from it.
type Forwarded = Arc<[AtomicU64; 2]>;

impl Proxy {
    /// Listens on `listen` (port 0 for any) and forwards to `target`. Needs a tokio runtime.
    pub async fn start(listen: SocketAddr, target: SocketAddr, link: Link) -> io::Result<Proxy> {
        let socket = new_socket(listen)?;
        socket.set_reuseaddr(true)?;
        socket.bind(listen)?;
        let listener = socket.listen(BACKLOG)?;
        let local_addr = listener.local_addr()?;
        let (commands, cut) = watch::channel(0);
        let forwarded = Forwarded::default();
        let accepting = tokio::spawn(accept(listener, target, link, forwarded.clone(), cut));
        Ok(Proxy { local_addr, commands, forwarded, accepting })
    }

    /// Where it listens.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Bytes that have crossed so far, over all connections: to the target, and from it. All that TCP carried, with the
    /// framing of whatever protocol is spoken.
    pub fn forwarded_bytes(&self) -> (u64, u64) {
        let [to_target, from_target] = &*self.forwarded;
        (to_target.load(Ordering::Relaxed), from_target.load(Ordering::Relaxed))
    }

    /// Cuts every open connection, as a path that breaks; new ones are still accepted.
    pub fn cut(&self) {
        self.commands.send_modify(|cuts| *cuts += 1);
    }

    /// Stops accepting, cuts every connection and waits until all is closed.
    pub async fn shutdown(mut self) {
        self.accepting.abort();
        // Cancelled is what was asked for.
        let _ = (&mut self.accepting).await;
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

fn new_socket(addr: SocketAddr) -> io::Result<TcpSocket> {
    let socket = if addr.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    socket.set_recv_buffer_size(SOCKET_BUFFER_BYTES)?;
    socket.set_send_buffer_size(SOCKET_BUFFER_BYTES)?;
    Ok(socket)
}

/// Connections belong to this task: they end with it.
async fn accept(
    listener: TcpListener,
    target: SocketAddr,
    link: Link,
    forwarded: Forwarded,
    cut: watch::Receiver<u64>,
) {
    let (mut connections, epoch) = (JoinSet::new(), Instant::now());
    let mut seed = 0;
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((client, _)) => {
                    seed += 2;
                    connections.spawn(forward(client, target, (link, epoch), seed, forwarded.clone(), cut.clone()));
                }
                Err(error) => {
                    warn!(%error, "the proxy could not accept a connection");
                    // Out of file descriptors, most likely: give some time to be closed.
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
            },
            Some(_) = connections.join_next() => {}
        }
    }
}

async fn forward(
    client: TcpStream,
    target: SocketAddr,
    (link, epoch): (Link, Instant),
    seed: u64,
    forwarded: Forwarded,
    mut cut: watch::Receiver<u64>,
) {
    cut.mark_unchanged();
    let connected = async { new_socket(target)?.connect(target).await };
    let server = match connected.await {
        Ok(server) => server,
        Err(error) => {
            warn!(%target, %error, "the proxy could not connect");
            return;
        }
    };
    for stream in [&client, &server] {
        if let Err(error) = stream.set_nodelay(true) {
            debug!(%error, "no TCP_NODELAY");
        }
    }
    let (from_client, to_client) = client.into_split();
    let (from_server, to_server) = server.into_split();
    let both_ways = async {
        tokio::try_join!(
            one_way(from_client, to_server, LinkModel::new(link, seed), holds_bytes(&link), epoch, &forwarded[0]),
            one_way(from_server, to_client, LinkModel::new(link, seed + 1), holds_bytes(&link), epoch, &forwarded[1]),
        )
    };
    tokio::select! {
        ended = both_ways => {
            if let Err(error) = ended {
                debug!(%error, "a forwarded connection broke");
            }
        }
        _ = cut.changed() => debug!("a forwarded connection was cut"),
    }
}

/// What a direction holds at most: what its delay keeps on the way, and a queue.
fn holds_bytes(link: &Link) -> usize {
    let delay_s = link.rtt_s / 2.0 + link.jitter_s + link.stall.map_or(0.0, |stall| stall.length_s);
    let holds = |bits_per_s: f64| (bits_per_s / 8.0 * (delay_s + link.queue_s.unwrap_or(QUEUE_S))) as usize;
    LinkModel::new(*link, 0)
        .bits_per_s()
        .map_or(UNLIMITED_HOLDS_BYTES, |bits_per_s| holds(bits_per_s).clamp(MIN_HOLDS_BYTES, UNLIMITED_HOLDS_BYTES))
}

/// Bytes on their way, with the room that they take.
struct Chunk {
    arrival: Instant,
    bytes: Vec<u8>,
    _room: OwnedSemaphorePermit,
}

async fn one_way(
    mut from: OwnedReadHalf,
    mut to: OwnedWriteHalf,
    mut model: LinkModel,
    holds_bytes: usize,
    epoch: Instant,
    forwarded: &AtomicU64,
) -> io::Result<()> {
    let room = Arc::new(Semaphore::new(holds_bytes));
    let (on_way, mut arriving) = mpsc::channel::<Chunk>(holds_bytes);
    let leave = async move {
        loop {
            let mut bytes = vec![0; CHUNK_BYTES];
            let count = from.read(&mut bytes).await?;
            if count == 0 {
                return Ok(());
            }
            bytes.truncate(count);
            let needed = u32::try_from(count).expect("a chunk is small");
            let Ok(room) = Arc::clone(&room).acquire_many_owned(needed).await else { return Ok(()) };
            let arrival_s = model.deliver(epoch.elapsed().as_secs_f64(), count);
            let arrival = epoch + Duration::from_secs_f64(arrival_s);
            if on_way.send(Chunk { arrival, bytes, _room: room }).await.is_err() {
                return Ok(());
            }
        }
    };
    let arrive = async move {
        while let Some(chunk) = arriving.recv().await {
            tokio::time::sleep_until(chunk.arrival).await;
            to.write_all(&chunk.bytes).await?;
            forwarded.fetch_add(chunk.bytes.len() as u64, Ordering::Relaxed);
        }
        to.shutdown().await
    };
    tokio::try_join!(leave, arrive).map(|_: ((), ())| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOPBACK: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 0);

    /// A server that sends back what it reads.
    async fn echo() -> SocketAddr {
        let listener = TcpListener::bind(LOOPBACK).await.unwrap();
        let addr = listener.local_addr().unwrap();
        tokio::spawn(async move {
            while let Ok((mut stream, _)) = listener.accept().await {
                tokio::spawn(async move {
                    let (mut from, mut to) = stream.split();
                    let _ = tokio::io::copy(&mut from, &mut to).await;
                    let _ = to.shutdown().await;
                });
            }
        });
        addr
    }

    #[tokio::test]
    async fn bytes_come_back_whole_and_in_order() {
        let proxy = Proxy::start(LOOPBACK, echo().await, "rtt=10,jitter=10,mbit=400".parse().unwrap()).await.unwrap();
        let stream = TcpStream::connect(proxy.local_addr()).await.unwrap();
        let (mut from, mut to) = stream.into_split();
        let sent: Vec<u8> = (0..1_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let expected = sent.clone();
        let sending = tokio::spawn(async move {
            to.write_all(&sent).await.unwrap();
            to.shutdown().await.unwrap();
        });
        let mut received = Vec::new();
        from.read_to_end(&mut received).await.unwrap();
        sending.await.unwrap();
        assert!(received == expected);
        assert_eq!(proxy.forwarded_bytes(), (1_000_000, 1_000_000));
        proxy.shutdown().await;
    }

    #[tokio::test]
    async fn delay_and_bandwidth_are_applied() {
        let link = "rtt=80,mbit=8".parse().unwrap();
        let proxy = Proxy::start(LOOPBACK, echo().await, link).await.unwrap();
        let mut stream = TcpStream::connect(proxy.local_addr()).await.unwrap();
        let start = Instant::now();
        stream.write_all(&[1]).await.unwrap();
        stream.read_exact(&mut [0]).await.unwrap();
        assert!(start.elapsed() >= Duration::from_millis(79), "a round trip takes its time");
        let start = Instant::now();
        let (mut from, mut to) = stream.split();
        let mut received = vec![0; 200_000];
        let (sent, got) = tokio::join!(to.write_all(&[7; 200_000]), from.read_exact(&mut received));
        sent.unwrap();
        got.unwrap();
        assert!(start.elapsed() >= Duration::from_millis(200), "200 kB at 1 MB/s");
    }

    #[tokio::test]
    async fn a_receiver_that_does_not_read_stops_its_sender() {
        let listener = TcpListener::bind(LOOPBACK).await.unwrap();
        let link = "mbit=1000".parse().unwrap();
        let proxy = Proxy::start(LOOPBACK, listener.local_addr().unwrap(), link).await.unwrap();
        let mut stream = TcpStream::connect(proxy.local_addr()).await.unwrap();
        let (_unread, _) = listener.accept().await.unwrap();
        // Far more than the proxy and both sockets hold.
        let everything = vec![0; 128 << 20];
        let written = tokio::time::timeout(Duration::from_secs(2), stream.write_all(&everything)).await;
        assert!(written.is_err(), "128 MiB went nowhere");
    }

    #[tokio::test]
    async fn cut_connections_end_and_new_ones_work() {
        let proxy = Proxy::start(LOOPBACK, echo().await, Link::default()).await.unwrap();
        let mut first = TcpStream::connect(proxy.local_addr()).await.unwrap();
        first.write_all(&[1]).await.unwrap();
        first.read_exact(&mut [0]).await.unwrap();
        proxy.cut();
        assert!(matches!(first.read(&mut [0]).await, Ok(0) | Err(_)));
        let mut second = TcpStream::connect(proxy.local_addr()).await.unwrap();
        second.write_all(&[2]).await.unwrap();
        second.read_exact(&mut [0]).await.unwrap();
        let addr = proxy.local_addr();
        proxy.shutdown().await;
        assert!(matches!(second.read(&mut [0]).await, Ok(0) | Err(_)));
        assert!(TcpStream::connect(addr).await.is_err());
    }

    #[tokio::test]
    async fn an_end_that_vanishes_ends_the_other() {
        let proxy = Proxy::start(LOOPBACK, LOOPBACK_CLOSED, Link::default()).await.unwrap();
        let mut stream = TcpStream::connect(proxy.local_addr()).await.unwrap();
        assert!(matches!(stream.read(&mut [0]).await, Ok(0) | Err(_)));
    }

    /// Port 1 of loopback: nothing listens there.
    const LOOPBACK_CLOSED: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 1);
}
