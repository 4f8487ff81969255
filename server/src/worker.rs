//! The threads that make updates: some look for what clients lack, each with a stage of its own, and some encode it. Sessions are
//! served in turn: each has at most one place in the queue, and where to look is planned when its turn comes, from its newest
//! pose. While one looking thread waits for the GPU another compares, and while an update is encoded the next ones are made.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

use protocol::wire::EncodedUpdate;
use tokio::sync::{oneshot, watch};

use crate::account::Counts;
use crate::client::Client;
use crate::frame::{self, Stage};
use crate::look_times::{self, Part};
use crate::plan::Reason;
use crate::queue::Queue;
use crate::stage_error::StageError;
use crate::stats::Stats;
use crate::viewer::Viewer;

/// Updates that wait for an encoder at most: one, so that what an update shows is never older than one encoding.
const ENCODER_QUEUE: usize = 1;
/// Looking threads for each that encodes: that takes a tenth of a look's time where views are compared on the GPU, and less where they are not.
const LOOKING_AN_ENCODER: usize = 4;

/// Work that nobody waits for takes one part in so many of the time at most, while there are turns to take.
const PARTS_FOR_TURNS: u32 = 20;

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
struct Turn {
    wish: Wish,
    look: Look,
    client: Box<Client>,
    reply: oneshot::Sender<Served>,
    queued: Instant,
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

/// Asks for updates. Dropping it ends its threads once the queue is empty.
pub struct Worker {
    turns: Arc<Queue<Turn>>,
    waiting: Arc<AtomicUsize>,
    failure: watch::Receiver<Option<String>>,
}

impl Worker {
    /// Starts the threads: one a stage, and those that encode.
    pub fn start(stages: Vec<Stage>, stats: Arc<Stats>) -> std::io::Result<Worker> {
        let turns = Arc::new(Queue::default());
        let (updates, encoder_queue) = mpsc::sync_channel(ENCODER_QUEUE);
        let (failed, failure) = watch::channel(None);
        let (failed, waiting) = (Arc::new(failed), Arc::new(AtomicUsize::new(0)));
        let encoder_queue = Arc::new(Mutex::new(encoder_queue));
        for index in 0..stages.len().div_ceil(LOOKING_AN_ENCODER) {
            let (queue, stats) = (encoder_queue.clone(), stats.clone());
            std::thread::Builder::new()
                .name(format!("encode-{index}"))
                .spawn(move || encode_updates(&queue, &stats))?;
        }
        for (index, stage) in stages.into_iter().enumerate() {
            let (turns, left, failed) = (Taker(turns.clone()), waiting.clone(), failed.clone());
            let (updates, stats) = (updates.clone(), stats.clone());
            std::thread::Builder::new().name(format!("images-{index}")).spawn(move || {
                // One of them does what nobody waits for: whatever it judges, all know.
                if let Err(error) = make_updates(stage, index == 0, &turns.0, &left, (&updates, &stats)) {
                    tracing::error!("no more images: {error}");
                    failed.send_replace(Some(error.to_string()));
                }
            })?;
        }
        Ok(Worker { turns, waiting, failure })
    }

    /// Takes a place in the queue. A session must have at most one.
    pub async fn serve(&self, client: Box<Client>, wish: Wish, look: Look) -> Result<Served, WorkerGone> {
        let (reply, served) = oneshot::channel();
        self.waiting.fetch_add(1, Ordering::Relaxed);
        self.turns.push(Turn { wish, look, client, reply, queued: Instant::now() }).map_err(|_| WorkerGone)?;
        served.await.map_err(|_| WorkerGone)
    }

    /// Whether no session waits for a turn, or has one.
    pub fn is_idle(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) == 0
    }

    /// Why there are no more images, once that is so.
    pub fn failure(&self) -> watch::Receiver<Option<String>> {
        self.failure.clone()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.turns.close();
    }
}

/// What a looking thread takes turns from. However the thread ends, by a panic too, no session waits for it: what still waits is dropped, and so answered.
struct Taker(Arc<Queue<Turn>>);

impl Drop for Taker {
    fn drop(&mut self) {
        self.0.give_up();
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
    works_aside: bool,
    queue: &Queue<Turn>,
    waiting: &AtomicUsize,
    (encoder, stats): (&mpsc::SyncSender<Unencoded>, &Stats),
) -> Result<(), StageError> {
    let mut aside_from = Instant::now();
    loop {
        let (next, begun) = (queue.try_next(), Instant::now());
        if works_aside && (next.is_none() || begun >= aside_from) {
            let has_worked = stage.work_aside()?;
            aside_from = Instant::now() + begun.elapsed() * PARTS_FOR_TURNS;
            if has_worked && next.is_none() {
                continue;
            }
        }
        let Some(turn) = next.or_else(|| queue.next()) else { break };
        let goes_on = make_update(&mut stage, turn, waiting, (encoder, stats));
        waiting.fetch_sub(1, Ordering::Relaxed);
        if !goes_on? {
            break;
        }
    }
    Ok(())
}

/// Serves a turn; whether there is still an encoder.
fn make_update(
    stage: &mut Stage,
    turn: Turn,
    waiting: &AtomicUsize,
    (encoder, stats): (&mpsc::SyncSender<Unencoded>, &Stats),
) -> Result<bool, StageError> {
    let Turn { wish, look, mut client, reply, queued } = turn;
    if reply.is_closed() {
        return Ok(true); // The client left while it waited.
    }
    let (viewer, now_s) = look();
    let started = Instant::now();
    stage.waited(&mut client, (started - queued).as_secs_f64());
    let made = match stage.update(&viewer, &mut client, now_s) {
        // Its own turn counts as one that waits.
        Ok(None) if wish == Wish::Next && waiting.load(Ordering::Relaxed) <= 1 => {
            stage.anticipate(&viewer, &mut client, now_s)
        }
        made => made,
    };
    stats.look_times.count(look_times::take(started.elapsed()));
    match made {
        Ok(None) => drop(reply.send(Served { client, update: None })),
        Ok(Some(made)) => {
            return Ok(encoder.send(Unencoded { made, look: started.elapsed(), client, reply }).is_ok());
        }
        // The session ends when its place in the queue is dropped unanswered.
        Err(StageError::Held(error)) => tracing::error!("an update that the client could not hold: {error}"),
        Err(error) => return Err(error),
    }
    Ok(true)
}

/// The next update to encode; `None` once no thread looks any more.
fn next_to_encode(queue: &Mutex<mpsc::Receiver<Unencoded>>) -> Option<Unencoded> {
    // Who panics while he waits leaves the queue as it is.
    queue.lock().unwrap_or_else(PoisonError::into_inner).recv().ok()
}

fn encode_updates(queue: &Mutex<mpsc::Receiver<Unencoded>>, stats: &Stats) {
    while let Some(Unencoded { made, look, mut client, reply }) = next_to_encode(queue) {
        let started = Instant::now();
        let update = made.encoded();
        let frame::Made { reason, counts, pixels, lights, .. } = made;
        stats.look_times.add(Part::Encode, started.elapsed());
        let light_bytes = update.bytes_of(lights.edits);
        stats.count_look(reason);
        stats.lights.count(&counts.lights, light_bytes, lights.took);
        if reason.is_passing() {
            client.pace.made(update.bytes.len(), pixels);
        } else if reason == Reason::Rest {
            client.rest.coded(update.bytes.len());
        } else if reason == Reason::Ahead {
            client.ahead.sent(update.bytes.len(), pixels);
            stats.ahead.count(counts.ahead, update.bytes.len());
        }
        // A client that left meanwhile needs no answer.
        drop(reply.send(Served {
            client,
            update: Some(Made { update, reason, counts, light_bytes, look, encode: started.elapsed() }),
        }));
    }
}
