//! The listener that lets connections in as far as their addresses may have them.

use std::io::{IoSlice, Write};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::serve::Listener;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use super::{Crowded, Peers, Place};

/// Connections at one time that are open only so that words reach who is turned away.
const LEAVING: usize = 64;
/// How long they are.
const LEAVES_WITHIN: Duration = Duration::from_secs(1);

/// Bytes that the system takes before the path does: a fragment of an update is 32 KiB.
#[cfg(any(target_os = "linux", target_os = "android"))]
const UNSENT_BYTES: u32 = 16 * 1024;

/// Who connected.
#[derive(Debug, Clone, Copy)]
pub struct Caller {
    /// From where.
    pub peer: SocketAddr,
    /// Why it is only to be told that there is too much of it.
    pub crowded: Option<Crowded>,
}

/// See the module.
pub struct Door {
    tcp: TcpListener,
    peers: Arc<Peers>,
    /// Whether a handshake of TLS follows, which is counted, and before which nothing can be said.
    is_over_tls: bool,
    leaving: Arc<Semaphore>,
}

impl Door {
    /// Before a listener.
    pub fn new(tcp: TcpListener, peers: Arc<Peers>, is_over_tls: bool) -> Door {
        Door { tcp, peers, is_over_tls, leaving: Arc::new(Semaphore::new(LEAVING)) }
    }

    fn admits(&self, peer: SocketAddr) -> Result<(Place, Option<Crowded>), Crowded> {
        let admitted = self.peers.connects(peer)?;
        if self.is_over_tls {
            self.peers.may_shake_hands(peer)?;
        }
        Ok(admitted)
    }

    fn turns_away(&self, stream: TcpStream, peer: SocketAddr, crowded: Crowded) {
        tracing::debug!(%peer, "turned away: {crowded}");
        if let Ok(place) = self.leaving.clone().try_acquire_owned()
            && !self.is_over_tls
        {
            tokio::spawn(async move {
                // Who takes no words goes without.
                drop(tokio::time::timeout(LEAVES_WITHIN, say(stream, crowded)).await);
                drop(place);
            });
        }
    }
}

impl Listener for Door {
    type Io = Admitted;
    type Addr = Caller;

    async fn accept(&mut self) -> (Admitted, Caller) {
        loop {
            // Where there are no more files it waits for a second by itself.
            let (stream, peer) = Listener::accept(&mut self.tcp).await;
            match self.admits(peer) {
                Ok((place, crowded)) => {
                    set_up(&stream);
                    return (Admitted { stream, _place: place }, Caller { peer, crowded });
                }
                Err(crowded) => self.turns_away(stream, peer, crowded),
            }
        }
    }

    fn local_addr(&self) -> std::io::Result<Caller> {
        Ok(Caller { peer: self.tcp.local_addr()?, crowded: None })
    }
}

/// Says why in HTTP, and waits until the other end has read it: what came in and was not read would make the system take it back.
async fn say(mut stream: TcpStream, crowded: Crowded) -> std::io::Result<()> {
    let status = match crowded {
        Crowded::Server => "503 Service Unavailable",
        _ => "429 Too Many Requests",
    };
    let mut answer = Vec::new();
    let body = format!("{crowded}\n");
    write!(answer, "HTTP/1.1 {status}\r\nRetry-After: 1\r\nConnection: close\r\nContent-Type: text/plain\r\n")?;
    write!(answer, "Content-Length: {}\r\n\r\n{body}", body.len())?;
    stream.write_all(&answer).await?;
    stream.shutdown().await?;
    let mut unread = [0; 1024];
    while stream.read(&mut unread).await? > 0 {}
    Ok(())
}

/// A connection that was let in.
pub struct Admitted {
    stream: TcpStream,
    _place: Place,
}

impl AsyncRead for Admitted {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, into: &mut ReadBuf<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, into)
    }
}

impl AsyncWrite for Admitted {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<std::io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<std::io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(cx, parts)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
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
