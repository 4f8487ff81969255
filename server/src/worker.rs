//! The two threads that make updates: one owns the GPU and looks for what clients lack, the other encodes it. Sessions are
//! served in turn: each has at most one place in the queue, and where to look is planned when its turn comes, from its newest
//! pose. While one session's update is encoded, the next one's is made.

use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use protocol::wire::{self, EncodedUpdate};
use tokio::sync::{oneshot, watch};

use crate::account::Counts;
use crate::client::Client;
use crate::frame::{self, Stage};
use crate::plan::Reason;
use crate::stage_error::StageError;
use crate::stats::Stats;
use crate::viewer::Viewer;

/// Updates that wait for the encoder at most: one, so that what an update shows is never older than one encoding.
const ENCODER_QUEUE: usize = 1;

/// Where a session's viewer is when its turn comes, and what time it is then.
pub type Look = Box<dyn FnOnce() -> (Viewer, f64) + Send>;

/// One session's place in the queue.
struct Turn {
    look: Look,
    client: Box<Client>,
    reply: oneshot::Sender<Served>,
}

/// What came of a turn.
pub struct Served {
    /// Given back, with the update taken in.
    pub client: Box<Client>,
    /// `None` where nothing was lacking.
    pub update: Option<Made>,
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

/// The worker is gone; see [`Worker::failure`].
#[derive(Debug, Clone, Copy, thiserror::Error)]
#[error("the rendering thread ended")]
pub struct WorkerGone;

/// Asks for updates. Dropping it ends both threads once the queue is empty.
pub struct Worker {
    turns: mpsc::SyncSender<Turn>,
    failure: watch::Receiver<Option<String>>,
}

impl Worker {
    /// Starts the threads for at most `sessions` sessions.
    pub fn start(stage: Stage, sessions: usize, stats: Arc<Stats>) -> std::io::Result<Worker> {
        let (turns, queue) = mpsc::sync_channel(sessions);
        let (updates, encoder_queue) = mpsc::sync_channel(ENCODER_QUEUE);
        let (failed, failure) = watch::channel(None);
        std::thread::Builder::new().name("encode".into()).spawn(move || encode_updates(&encoder_queue, &stats))?;
        std::thread::Builder::new().name("images".into()).spawn(move || {
            if let Err(error) = make_updates(stage, &queue, &updates) {
                tracing::error!("no more images: {error}");
                failed.send_replace(Some(error.to_string()));
            }
        })?;
        Ok(Worker { turns, failure })
    }

    /// Takes a place in the queue. A session must have at most one.
    pub async fn serve(&self, client: Box<Client>, look: Look) -> Result<Served, WorkerGone> {
        let (reply, served) = oneshot::channel();
        // The queue has a place for every session, so it is full only if one has two.
        self.turns.try_send(Turn { look, client, reply }).map_err(|_| WorkerGone)?;
        served.await.map_err(|_| WorkerGone)
    }

    /// Why there are no more images, once that is so.
    pub fn failure(&self) -> watch::Receiver<Option<String>> {
        self.failure.clone()
    }
}

/// An update on its way to the encoder.
struct Unencoded {
    made: frame::Made,
    look: Duration,
    client: Box<Client>,
    reply: oneshot::Sender<Served>,
}

fn make_updates(
    mut stage: Stage,
    queue: &mpsc::Receiver<Turn>,
    encoder: &mpsc::SyncSender<Unencoded>,
) -> Result<(), StageError> {
    while let Ok(Turn { look, mut client, reply }) = queue.recv() {
        if reply.is_closed() {
            continue; // The client left while it waited.
        }
        let (viewer, now_s) = look();
        let started = Instant::now();
        match stage.update(&viewer, &mut client, now_s) {
            Ok(None) => drop(reply.send(Served { client, update: None })),
            Ok(Some(made)) => {
                let look = started.elapsed();
                if encoder.send(Unencoded { made, look, client, reply }).is_err() {
                    return Ok(());
                }
            }
            // The session ends when its place in the queue is dropped unanswered.
            Err(StageError::Held(error)) => tracing::error!("an update that the client could not hold: {error}"),
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn encode_updates(queue: &mpsc::Receiver<Unencoded>, stats: &Stats) {
    while let Ok(Unencoded { made, look, mut client, reply }) = queue.recv() {
        let started = Instant::now();
        let frame::Made { reason, update, coding, counts, pixels, lights } = made;
        let update = wire::encode_update(&update, coding);
        let light_bytes = update.bytes_of(lights.edits);
        stats.count_look(reason);
        stats.lights.count(&counts.lights, light_bytes, lights.took);
        if reason.is_passing() {
            client.pace.made(update.bytes.len(), pixels);
        }
        // A client that left meanwhile needs no answer.
        drop(reply.send(Served {
            client,
            update: Some(Made { update, reason, counts, light_bytes, look, encode: started.elapsed() }),
        }));
    }
}
