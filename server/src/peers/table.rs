//! What each address has taken.

use std::collections::HashMap;

use protocol::session::TokenBucket;

use super::Address;
use crate::limits::PeerLimits;

/// Addresses that are remembered while they have nothing open.
pub(super) const REMEMBERED: usize = 4096;

/// What is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Connection,
    /// One that has not said who it is.
    Doorstep,
}

/// See the module.
#[derive(Default)]
pub(super) struct Table {
    by_address: HashMap<Address, Taken>,
}

struct Taken {
    open: [usize; 2],
    handshakes: TokenBucket,
    seen_at_s: f64,
}

impl Table {
    pub fn len(&self) -> usize {
        self.by_address.len()
    }

    /// Takes one more where fewer than `most` are taken; how many are then.
    pub fn take(
        &mut self,
        address: Address,
        kind: Kind,
        most: usize,
        limits: &PeerLimits,
        now_s: f64,
    ) -> Option<usize> {
        let open = &mut self.of(address, limits, now_s).open[kind as usize];
        (*open < most).then(|| {
            *open += 1;
            *open
        })
    }

    pub fn give_back(&mut self, address: Address, kind: Kind) {
        if let Some(taken) = self.by_address.get_mut(&address) {
            let open = &mut taken.open[kind as usize];
            *open = open.saturating_sub(1);
        }
    }

    pub fn shakes_hands(&mut self, address: Address, limits: &PeerLimits, now_s: f64) -> bool {
        self.of(address, limits, now_s).handshakes.take(now_s)
    }

    fn of(&mut self, address: Address, limits: &PeerLimits, now_s: f64) -> &mut Taken {
        if self.by_address.len() >= REMEMBERED && !self.by_address.contains_key(&address) {
            self.forget_one();
        }
        let PeerLimits { handshakes_per_s, handshake_burst, .. } = *limits;
        let taken = self.by_address.entry(address).or_insert_with(|| Taken {
            open: [0; 2],
            handshakes: TokenBucket::new(handshakes_per_s, handshake_burst, now_s),
            seen_at_s: now_s,
        });
        taken.seen_at_s = now_s;
        taken
    }

    /// The one without anything open that was seen longest ago; none where all have something open, which the total of connections bounds.
    fn forget_one(&mut self) {
        let idle = self.by_address.iter().filter(|(_, taken)| taken.open == [0; 2]);
        let oldest = idle.min_by(|(_, a), (_, b)| a.seen_at_s.total_cmp(&b.seen_at_s)).map(|(address, _)| *address);
        if let Some(oldest) = oldest {
            self.by_address.remove(&oldest);
        }
    }
}
