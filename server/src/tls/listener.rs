//! Connections whose handshake is done.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use axum::serve::Listener;
use rustls::ServerConfig;
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;

use crate::peers::{Admitted, Caller, Door};

/// A peer that has not shaken hands after this is given up. It takes a few round trips, and slow paths have half a second each.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(10);
/// Handshakes at one time at most; where one more begins, the oldest is given up. As many as sessions by default.
const MAX_HANDSHAKES: usize = 256;

/// Accepts connections over TLS. Handshakes run beside each other: who stalls holds up nobody.
pub struct TlsListener {
    door: Door,
    configs: watch::Receiver<Arc<ServerConfig>>,
    handshakes: JoinSet<Option<Accepted>>,
    /// Of them, as they began; some may have ended.
    oldest: VecDeque<AbortHandle>,
}

type Accepted = (TlsStream<Admitted>, Caller);

impl TlsListener {
    /// Each connection takes the newest of `configs`.
    pub(super) fn new(door: Door, configs: watch::Receiver<Arc<ServerConfig>>) -> TlsListener {
        TlsListener { door, configs, handshakes: JoinSet::new(), oldest: VecDeque::new() }
    }
}

impl Listener for TlsListener {
    type Io = TlsStream<Admitted>;
    type Addr = Caller;

    async fn accept(&mut self) -> Accepted {
        loop {
            tokio::select! {
                Some(ended) = self.handshakes.join_next() => {
                    if let Ok(Some(accepted)) = ended {
                        return accepted;
                    }
                }
                (stream, caller) = self.door.accept() => {
                    while self.oldest.pop_front_if(|oldest| oldest.is_finished()).is_some() {}
                    if self.handshakes.len() >= MAX_HANDSHAKES
                        && let Some(oldest) = self.oldest.pop_front()
                    {
                        oldest.abort();
                    }
                    let config = self.configs.borrow().clone();
                    self.oldest.push_back(self.handshakes.spawn(shake_hands(config, stream, caller)));
                }
            }
        }
    }

    fn local_addr(&self) -> std::io::Result<Caller> {
        self.door.local_addr()
    }
}

/// `None` where it fails, which is the peer's affair: it may speak plain HTTP, or not trust the certificate.
async fn shake_hands(config: Arc<ServerConfig>, stream: Admitted, caller: Caller) -> Option<Accepted> {
    let peer = caller.peer;
    match tokio::time::timeout(HANDSHAKE_WITHIN, TlsAcceptor::from(config).accept(stream)).await {
        Ok(Ok(stream)) => Some((stream, caller)),
        Ok(Err(error)) => {
            tracing::debug!(%peer, "no TLS: {error}");
            None
        }
        Err(_) => {
            tracing::debug!(%peer, "no TLS: no handshake within {} s", HANDSHAKE_WITHIN.as_secs());
            None
        }
    }
}
