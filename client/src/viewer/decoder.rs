//! Decoding updates away from the picture.
//!
//! Natively a thread decodes, so that a large update never holds up a frame. In the browser, and where results must not depend
//! on the machine's speed, one update is decoded a call, between two frames; updates stay in order either way.

use std::collections::VecDeque;

use protocol::session::ReceivedUpdate;
use protocol::wire::{self, UpdateHead, WireError};
use protocol::{Limits, Update};
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
    /// Its edits, or what is wrong with it.
    pub result: Result<Update, WireError>,
    /// What decoding took.
    pub decode_ms: f64,
}

#[derive(Debug)]
struct Job {
    session: u64,
    update: ReceivedUpdate,
}

/// See the module.
#[derive(Debug)]
pub struct Decoder {
    limits: Limits,
    place: Place,
}

#[derive(Debug)]
enum Place {
    Here(VecDeque<Job>),
    #[cfg(not(target_arch = "wasm32"))]
    Thread(thread::DecodeThread),
}

impl Decoder {
    /// Decodes when asked for results.
    pub fn inline(limits: Limits) -> Decoder {
        Decoder { limits, place: Place::Here(VecDeque::new()) }
    }

    /// Decodes on a thread of its own, which calls `wake` after each update.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn on_thread(limits: Limits, wake: std::sync::Arc<dyn Fn() + Send + Sync>) -> std::io::Result<Decoder> {
        let place = Place::Thread(thread::DecodeThread::start(limits.clone(), wake)?);
        Ok(Decoder { limits, place })
    }

    /// Takes an update in. What may wait is bounded by the credit that the server has.
    pub fn push(&mut self, session: u64, update: ReceivedUpdate) {
        let job = Job { session, update };
        match &mut self.place {
            Place::Here(jobs) => jobs.push_back(job),
            #[cfg(not(target_arch = "wasm32"))]
            Place::Thread(thread) => thread.push(job),
        }
    }

    /// The next decoded update, where there is one.
    pub fn poll(&mut self) -> Option<Decoded> {
        match &mut self.place {
            Place::Here(jobs) => jobs.pop_front().map(|job| decode(job, &self.limits)),
            #[cfg(not(target_arch = "wasm32"))]
            Place::Thread(thread) => thread.poll(),
        }
    }
}

fn decode(job: Job, limits: &Limits) -> Decoded {
    let begin = Instant::now();
    let result = wire::decode_update(&job.update.bytes, limits);
    Decoded {
        session: job.session,
        head: job.update.head,
        arrived_at_s: job.update.arrived_at_s,
        result,
        decode_ms: begin.elapsed().as_secs_f64() * 1e3,
    }
}

#[cfg(not(target_arch = "wasm32"))]
mod thread {
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, Sender, channel};

    use protocol::Limits;

    use super::{Decoded, Job, decode};

    #[derive(Debug)]
    pub(super) struct DecodeThread {
        jobs: Sender<Job>,
        decoded: Receiver<Decoded>,
    }

    impl DecodeThread {
        pub fn start(limits: Limits, wake: Arc<dyn Fn() + Send + Sync>) -> std::io::Result<DecodeThread> {
            let (jobs, jobs_out) = channel::<Job>();
            let (decoded_in, decoded) = channel();
            // The thread ends when the queue of jobs is dropped.
            std::thread::Builder::new().name("decode".to_owned()).spawn(move || {
                for job in jobs_out {
                    if decoded_in.send(decode(job, &limits)).is_err() {
                        return;
                    }
                    wake();
                }
            })?;
            Ok(DecodeThread { jobs, decoded })
        }

        pub fn push(&self, job: Job) {
            // Fails only where the thread panicked, whose message has been printed; the picture then stops to change.
            let _ = self.jobs.send(job);
        }

        pub fn poll(&self) -> Option<Decoded> {
            self.decoded.try_recv().ok()
        }
    }
}
