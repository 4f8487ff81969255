//! Who is connected from where, and what all peers of one address may take together, so that nobody takes it from others.
//!
//! - [`Peers`]: what each address has taken; [`Crowded`]: what it may not take beside that. [`Place`] and [`Doorstep`] are given back when they are dropped.
//! - [`Door`]: the listener that admits connections by it, and says of whom ([`Caller`]); [`Address`]: what counts as one address.
//!
//! What is remembered is bounded: an address is forgotten when it has nothing open and others come, the one that was seen longest ago first. So somebody with
//! many networks of his own takes no memory, and no more than the total of open connections.

mod address;
mod door;
mod table;

use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use axum::http::HeaderMap;
use thiserror::Error;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

pub use address::Address;
pub use door::{Admitted, Caller, Door};
use table::{Kind, Table};

use crate::limits::{PeerLimits, ServerLimits};
use crate::open_files;

/// Connections beside those of sessions and of who has not greeted: pages and their files, and what is asked of a server.
const PAGES: usize = 1024;
/// Beyond what an address may open, so many more of its connections are let in to be told so.
const TOLD: usize = 8;

/// What a peer may not take now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Crowded {
    /// As many connections as the server takes are open.
    #[error("as many connections as this server takes are open")]
    Server,
    /// As many connections of its address are open.
    #[error("as many connections from one address as are let in are open: {0}")]
    Connections(usize),
    /// As many of its address have not said who they are.
    #[error("too many from this address have not said who they are")]
    Doorsteps,
    /// Handshakes of its address came too fast.
    #[error("handshakes from this address come too fast")]
    Handshakes,
}

impl Crowded {
    /// All of them, to be counted.
    pub const ALL: [Crowded; 4] = [Crowded::Server, Crowded::Connections(0), Crowded::Doorsteps, Crowded::Handshakes];

    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Crowded::Server => "server",
            Crowded::Connections(_) => "connections",
            Crowded::Doorsteps => "doorsteps",
            Crowded::Handshakes => "handshakes",
        }
    }

    fn index(self) -> usize {
        Crowded::ALL.iter().position(|crowded| crowded.name() == self.name()).unwrap_or(0)
    }
}

/// See the module.
pub struct Peers {
    limits: PeerLimits,
    proxies: Vec<IpAddr>,
    table: Mutex<Table>,
    /// One permit a connection.
    connections: Arc<Semaphore>,
    /// One permit a connection that has not said who it is.
    doorsteps: Arc<Semaphore>,
    refused: [AtomicU64; Crowded::ALL.len()],
    started: Instant,
}

impl Peers {
    /// Nobody yet. `proxies`: who is believed to say whom it asks for.
    pub fn new(limits: &ServerLimits, proxies: &[IpAddr]) -> Peers {
        let most = limits.clients.saturating_add(limits.doorsteps).saturating_add(PAGES);
        let allowed = open_files::for_sockets().map_or(most, |allowed| allowed.min(most)).min(Semaphore::MAX_PERMITS);
        if allowed < limits.clients {
            tracing::warn!("the system allows {allowed} connections, which is less than --max-clients");
        }
        Peers {
            limits: limits.peers,
            proxies: proxies.to_vec(),
            table: Mutex::default(),
            connections: Arc::new(Semaphore::new(allowed)),
            doorsteps: Arc::new(Semaphore::new(limits.doorsteps)),
            refused: Default::default(),
            started: Instant::now(),
        }
    }

    /// Whom a request is from: where a proxy that is trusted asks, the last one that it names and that is no such proxy itself.
    pub fn who_asks(&self, peer: SocketAddr, headers: &HeaderMap) -> SocketAddr {
        address::who_asks(peer, headers, &self.proxies)
    }

    /// Lets a connection in; a few more of an address than it may have, so that they can be told.
    fn connects(self: &Arc<Peers>, peer: SocketAddr) -> Result<(Place, Option<Crowded>), Crowded> {
        let of_all = self.connections.clone().try_acquire_owned().map_err(|_| self.refuses(Crowded::Server))?;
        let most = self.limits.connections;
        let crowded = Crowded::Connections(most);
        let (mut place, open) = self.take(peer, Kind::Connection, most.saturating_add(TOLD), crowded)?;
        place.of_all = Some(of_all);
        Ok((place, (open > most).then(|| self.refuses(crowded))))
    }

    /// A place beside those of connections, for who comes by way of a proxy: a session of its own address.
    pub fn takes_place(self: &Arc<Peers>, peer: SocketAddr) -> Result<Place, Crowded> {
        let most = self.limits.connections;
        self.take(peer, Kind::Connection, most, Crowded::Connections(most)).map(|(place, _)| place)
    }

    /// Whether an address may shake hands once more now.
    pub fn may_shake_hands(&self, peer: SocketAddr) -> Result<(), Crowded> {
        let Some(address) = self.limited(peer) else { return Ok(()) };
        let now_s = self.started.elapsed().as_secs_f64();
        if self.table().shakes_hands(address, &self.limits, now_s) {
            Ok(())
        } else {
            Err(self.refuses(Crowded::Handshakes))
        }
    }

    /// A place for who has not said who it is.
    pub fn doorstep(self: &Arc<Peers>, peer: SocketAddr) -> Result<Doorstep, Crowded> {
        let of_all = self.doorsteps.clone().try_acquire_owned().map_err(|_| self.refuses(Crowded::Server))?;
        let (place, _) = self.take(peer, Kind::Doorstep, self.limits.doorsteps, Crowded::Doorsteps)?;
        Ok(Doorstep { _of_all: of_all, _place: place })
    }

    /// How often something was refused, by what.
    pub fn refused(&self) -> [(Crowded, u64); Crowded::ALL.len()] {
        Crowded::ALL.map(|crowded| (crowded, self.refused[crowded.index()].load(Ordering::Relaxed)))
    }

    /// Addresses that are remembered.
    pub fn known(&self) -> usize {
        self.table().len()
    }

    /// One more of an address, and how many of it there are then; none where they are not counted.
    fn take(
        self: &Arc<Peers>,
        peer: SocketAddr,
        kind: Kind,
        most: usize,
        or: Crowded,
    ) -> Result<(Place, usize), Crowded> {
        let Some(address) = self.limited(peer) else { return Ok((Place::default(), 0)) };
        let now_s = self.started.elapsed().as_secs_f64();
        let taken = self.table().take(address, kind, most, &self.limits, now_s);
        let count = taken.ok_or_else(|| self.refuses(or))?;
        Ok((Place { of_all: None, taken: Some((self.clone(), address, kind)) }, count))
    }

    /// `None` where nothing is counted: programs of this machine, and proxies that are trusted.
    fn limited(&self, peer: SocketAddr) -> Option<Address> {
        let ip = peer.ip().to_canonical();
        let is_free =
            self.limits.connections == 0 || (ip.is_loopback() && !self.limits.loopback) || self.proxies.contains(&ip);
        (!is_free).then(|| Address::of(ip))
    }

    fn refuses(&self, crowded: Crowded) -> Crowded {
        self.refused[crowded.index()].fetch_add(1, Ordering::Relaxed);
        crowded
    }

    fn table(&self) -> MutexGuard<'_, Table> {
        // Every change is one call.
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A connection, or one that has not said who it is, among those of its address.
#[derive(Default)]
pub struct Place {
    of_all: Option<OwnedSemaphorePermit>,
    taken: Option<(Arc<Peers>, Address, Kind)>,
}

impl Drop for Place {
    fn drop(&mut self) {
        if let Some((peers, address, kind)) = self.taken.take() {
            peers.table().give_back(address, kind);
        }
    }
}

/// Held by a connection until it has said who it is.
pub struct Doorstep {
    _of_all: OwnedSemaphorePermit,
    _place: Place,
}

#[cfg(test)]
mod tests;
