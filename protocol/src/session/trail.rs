//! What a client that comes back may lack: the updates that it did not acknowledge.
//!
//! A connection that is cut off takes updates with it that were sent and never came, or came and were not acknowledged. As long as they are kept, a client that
//! says how far it got is sent the rest, and both copies are one again: that costs the difference, not all that is held.

use std::collections::VecDeque;

use crate::message::Resume;
use crate::wire::PackedUpdate;

/// What was sent in a session since the last update that its client is known to hold. It outlives the connection.
#[derive(Debug, Clone, Default)]
pub struct Trail {
    /// Number and digest of the last update that was acknowledged.
    acknowledged: Option<(u64, u64)>,
    sent: VecDeque<PackedUpdate>,
}

impl Trail {
    pub(super) fn sent(&mut self, update: &PackedUpdate) {
        self.sent.push_back(update.clone());
    }

    /// The client holds this update and all before it.
    pub(super) fn acknowledged(&mut self, number: u64) {
        while let Some(update) = self.sent.pop_front_if(|update| update.number <= number) {
            self.acknowledged = Some((update.number, update.digest));
        }
    }

    /// The client's copy begins anew: nothing leads on from what was sent.
    pub(super) fn forget(&mut self) {
        *self = Trail::default();
    }

    /// What a client lacks that holds this; `None` where its copy is not one that this session made.
    pub(super) fn after(mut self, held: Resume) -> Option<Trail> {
        self.acknowledged(held.number);
        (self.acknowledged == Some((held.number, held.digest))).then_some(self)
    }

    /// The updates that it is made of, oldest first.
    pub(super) fn updates(&self) -> impl Iterator<Item = &PackedUpdate> {
        self.sent.iter()
    }

    /// What keeping it costs, in bytes.
    pub fn bytes(&self) -> usize {
        self.sent.iter().map(|update| update.bytes).sum()
    }
}
