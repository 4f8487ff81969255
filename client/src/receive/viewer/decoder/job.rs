//! An update that waits to be decoded, and what became of it.

use protocol::session::ReceivedUpdate;
use protocol::wire::{self, UpdateHead, WireError};
use protocol::{Limits, Update};
use surface::{Build, BuiltSurfaces};
use web_time::Instant;

/// An update with what became of it.
#[derive(Debug)]
pub struct Decoded {
    /// Which connection it came by, so that one of an earlier session is told apart.
    pub session: u64,
    /// What its first bytes say.
    pub head: UpdateHead,
    /// When its last fragment came.
    pub arrived_at_s: f64,
    /// What it took of the path.
    pub bytes: usize,
    /// Its edits, or what is wrong with it, in words.
    pub result: Result<Update, String>,
    /// What decoding took.
    pub decode_ms: f64,
    /// Surfaces of its patches, where they are built beside the drawing.
    pub built: BuiltSurfaces,
}

#[derive(Debug)]
pub(super) struct Job {
    pub session: u64,
    pub update: ReceivedUpdate,
    /// How surfaces are built of it, if at all.
    pub build: Option<Build>,
}

/// Decodes an update, and says how many milliseconds that took.
pub(super) fn measured(bytes: &[u8], limits: &Limits) -> (Result<Update, WireError>, f64) {
    let begin = Instant::now();
    let result = wire::decode_update(bytes, limits);
    (result, begin.elapsed().as_secs_f64() * 1e3)
}

impl Job {
    pub fn decoded(self, result: Result<Update, String>, decode_ms: f64, built: BuiltSurfaces) -> Decoded {
        let Job { session, update, build: _ } = self;
        let (head, arrived_at_s, bytes) = (update.head, update.arrived_at_s, update.bytes.len());
        Decoded { session, head, arrived_at_s, bytes, result, decode_ms, built }
    }
}
