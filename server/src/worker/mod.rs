//! The threads that make updates: some look for what clients lack, each with a stage of its own, and some encode it. Sessions are
//! served in turn: each has at most one place in the queue, and where to look is planned when its turn comes, from its newest
//! pose. While one looking thread waits for the GPU another compares, and while an update is encoded the next ones are made.
//!
//! - `turn`: what is asked, and what comes of it; `looking`, `encoding`: the threads.

mod encoding;
mod looking;
mod turn;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Instant;

use tokio::sync::{oneshot, watch};

use crate::client::Client;
use crate::frame::Stage;
use crate::queue::Queue;
use crate::stats::Stats;
use encoding::encode_updates;
use looking::Looking;
use turn::Turn;
pub use turn::{Look, Made, NotServed, Served, Wish};

/// Updates that wait for an encoder at most: one, so that what an update shows is never older than one encoding.
const ENCODER_QUEUE: usize = 1;
/// Looking threads for each that encodes: that takes a tenth of a look's time where views are compared on the GPU, and less where they are not.
const LOOKING_AN_ENCODER: usize = 4;

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
            let (turns, waiting, failed) = (Taker(turns.clone()), waiting.clone(), failed.clone());
            let (encoder, stats) = (updates.clone(), stats.clone());
            std::thread::Builder::new().name(format!("images-{index}")).spawn(move || {
                let (queue, waiting, encoder, stats) = (&*turns.0, &*waiting, &encoder, &*stats);
                let works_aside = index == 0;
                let mut looking = Looking { stage, works_aside, queue, waiting, encoder, stats, failures: 0 };
                if let Err(fault) = looking.run() {
                    tracing::error!("no more images: {fault}");
                    failed.send_replace(Some(fault.to_string()));
                }
            })?;
        }
        Ok(Worker { turns, waiting, failure })
    }

    /// Takes a place in the queue. A session must have at most one.
    pub async fn serve(&self, client: Box<Client>, wish: Wish, look: Look) -> Result<Served, NotServed> {
        let (reply, served) = oneshot::channel();
        self.waiting.fetch_add(1, Ordering::Relaxed);
        self.turns.push(Turn { wish, look, client, reply, queued: Instant::now() }).map_err(|_| NotServed::Gone)?;
        served.await.unwrap_or(Err(NotServed::Gone))
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

/// What a looking thread takes turns from. However the thread ends, no session waits for it: what still waits is dropped, and so answered.
struct Taker(Arc<Queue<Turn>>);

impl Drop for Taker {
    fn drop(&mut self) {
        self.0.give_up();
    }
}
