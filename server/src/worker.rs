//! The two threads that make updates: one owns the GPU and makes images, the other encodes them. Sessions are served in
//! turn: each has at most one place in the queue, and what it gets is planned when its turn comes, from its newest pose.
//! While one session's images are encoded, the next one's are made.

use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use protocol::wire::EncodedUpdate;
use tokio::sync::{oneshot, watch};

use crate::frame::{ClientCopy, Frame, Stage};
use crate::imager::ImagerError;
use crate::plan::Reason;
use crate::stats::Stats;
use crate::viewer::Viewer;

/// Frames that wait for the encoder at most: one, so that the images of a frame are never older than one encoding.
const ENCODER_QUEUE: usize = 1;

/// Where a session's viewer is when its turn comes, and what time it is then.
pub type Look = Box<dyn FnOnce() -> (Viewer, f64) + Send>;

/// One session's place in the queue.
struct Turn {
    look: Look,
    copy: Box<ClientCopy>,
    reply: oneshot::Sender<Served>,
}

/// What came of a turn.
pub struct Served {
    /// Given back, with the update taken in.
    pub copy: Box<ClientCopy>,
    /// `None` where the held set still serves.
    pub update: Option<Made>,
}

/// An update that was made.
pub struct Made {
    /// To be sent.
    pub update: EncodedUpdate,
    /// Why it was made.
    pub reason: Reason,
    /// Samples in it.
    pub samples: usize,
    /// Time for the images, in wall time.
    pub images: Duration,
    /// Time for edits and encoding, in wall time.
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
        let (frames, encoder_queue) = mpsc::sync_channel(ENCODER_QUEUE);
        let (failed, failure) = watch::channel(None);
        std::thread::Builder::new().name("encode".into()).spawn(move || encode_frames(&encoder_queue, &stats))?;
        std::thread::Builder::new().name("images".into()).spawn(move || {
            if let Err(error) = make_images(stage, &queue, &frames) {
                tracing::error!("no more images: {error}");
                failed.send_replace(Some(error.to_string()));
            }
        })?;
        Ok(Worker { turns, failure })
    }

    /// Takes a place in the queue. A session must have at most one.
    pub async fn serve(&self, copy: Box<ClientCopy>, look: Look) -> Result<Served, WorkerGone> {
        let (reply, served) = oneshot::channel();
        // The queue has a place for every session, so it is full only if one has two.
        self.turns.try_send(Turn { look, copy, reply }).map_err(|_| WorkerGone)?;
        served.await.map_err(|_| WorkerGone)
    }

    /// Why there are no more images, once that is so.
    pub fn failure(&self) -> watch::Receiver<Option<String>> {
        self.failure.clone()
    }
}

/// A frame on its way to the encoder.
struct Unencoded {
    frame: Frame,
    images: Duration,
    copy: Box<ClientCopy>,
    reply: oneshot::Sender<Served>,
}

fn make_images(
    mut stage: Stage,
    queue: &mpsc::Receiver<Turn>,
    frames: &mpsc::SyncSender<Unencoded>,
) -> Result<(), ImagerError> {
    while let Ok(Turn { look, copy, reply }) = queue.recv() {
        if reply.is_closed() {
            continue; // The client left while it waited.
        }
        let (viewer, now_s) = look();
        let started = Instant::now();
        match stage.frame(&viewer, copy.coverage(), now_s)? {
            None => drop(reply.send(Served { copy, update: None })),
            Some(frame) => {
                let images = started.elapsed();
                if frames.send(Unencoded { frame, images, copy, reply }).is_err() {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}

fn encode_frames(queue: &mpsc::Receiver<Unencoded>, stats: &Stats) {
    while let Ok(Unencoded { frame, images, mut copy, reply }) = queue.recv() {
        let started = Instant::now();
        let reason = frame.reason;
        let samples = frame.images.iter().map(protocol::DepthImage::sample_count).sum();
        match copy.update(frame) {
            Ok(update) => {
                stats.count_set(reason);
                let made = Made { update, reason, samples, images, encode: started.elapsed() };
                // A client that left meanwhile needs no answer.
                drop(reply.send(Served { copy, update: Some(made) }));
            }
            // The session ends when its place in the queue is dropped unanswered.
            Err(error) => tracing::error!("an update that the client could not hold: {error}"),
        }
    }
}
