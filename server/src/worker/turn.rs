//! A session's turn, and what comes of it.

use std::time::{Duration, Instant};

use protocol::wire::EncodedUpdate;
use thiserror::Error;
use tokio::sync::oneshot;

use crate::account::Counts;
use crate::client::Client;
use crate::fault::Fault;
use crate::frame;
use crate::plan::Reason;
use crate::viewer::Viewer;

/// Where a session's viewer is when its turn comes, and what time it is then.
pub type Look = Box<dyn FnOnce() -> (Viewer, f64) + Send>;

/// What a turn is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// What the viewer lacks now.
    Now,
    /// What it will need next, if nobody else waits by then; see [`crate::anticipate`].
    Next,
}

/// One session's place in the queue.
pub(super) struct Turn {
    pub wish: Wish,
    pub look: Look,
    pub client: Box<Client>,
    pub reply: Reply,
    pub queued: Instant,
}

/// Where what comes of a turn goes.
pub(super) type Reply = oneshot::Sender<Result<Served, NotServed>>;

/// What came of a turn.
pub struct Served {
    /// Given back, with the update taken in.
    pub client: Box<Client>,
    /// `None` where nothing was lacking.
    pub update: Option<Made>,
}

/// Why nothing came of it.
#[derive(Debug, Clone, Error)]
pub enum NotServed {
    /// The worker is gone; see [`super::Worker::failure`].
    #[error("the rendering thread ended")]
    Gone,
    /// This turn failed, and what is known of the client went with it; others have theirs.
    #[error(transparent)]
    Fault(#[from] Fault),
}

/// An update that was made.
pub struct Made {
    /// To be sent.
    pub update: EncodedUpdate,
    /// Why it was made.
    pub reason: Reason,
    /// What it did, in samples.
    pub counts: Counts,
    /// Bytes of it that are for lights.
    pub light_bytes: usize,
    /// Time for views and edits, in wall time.
    pub look: Duration,
    /// Time for coding, in wall time.
    pub encode: Duration,
}

/// An update on its way to the encoder.
pub(super) struct Unencoded {
    pub made: frame::Made,
    pub look: Duration,
    pub client: Box<Client>,
    pub reply: Reply,
}
