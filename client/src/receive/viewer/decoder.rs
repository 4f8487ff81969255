//! Decoding updates away from the picture.
//!
//! Natively a thread decodes, so that a large update never holds up a frame; in the browser a web worker does, which shares no
//! memory with the page ([`elsewhere`]). Where results must not depend on the machine's speed, and where there is no worker, one
//! update is decoded a call, between two frames. Updates stay in order in every place.

mod elsewhere;
mod job;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use protocol::Limits;
use protocol::session::ReceivedUpdate;
use web_time::Instant;

use elsewhere::Elsewhere;
pub use elsewhere::{DecodeWorker, answer};
pub use job::Decoded;
use job::{Job, measured};

/// See the module.
#[derive(Debug)]
pub struct Decoder {
    limits: Limits,
    place: Place,
}

#[derive(Debug)]
enum Place {
    Here(VecDeque<Job>),
    Elsewhere(Elsewhere),
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

    /// Decodes by a worker; where it fails, as [`Decoder::inline`] does, beginning with what the worker has not answered.
    pub fn elsewhere(limits: Limits, worker: Box<dyn DecodeWorker>) -> Decoder {
        Decoder { limits, place: Place::Elsewhere(Elsewhere::new(worker)) }
    }

    /// Whether another thread or a worker decodes, so that no frame waits for it.
    pub fn is_beside(&self) -> bool {
        !matches!(self.place, Place::Here(_))
    }

    /// Takes an update in. What may wait is bounded by the credit that the server has.
    pub fn push(&mut self, session: u64, update: ReceivedUpdate) {
        let job = Job { session, update };
        match &mut self.place {
            Place::Here(jobs) => jobs.push_back(job),
            Place::Elsewhere(elsewhere) => elsewhere.push(job),
            #[cfg(not(target_arch = "wasm32"))]
            Place::Thread(thread) => thread.push(job),
        }
    }

    /// The next decoded update, where there is one.
    pub fn poll(&mut self) -> Option<Decoded> {
        if let Place::Elsewhere(elsewhere) = &mut self.place {
            match elsewhere.poll(Instant::now()) {
                Ok(decoded) => return decoded,
                Err(unanswered) => self.place = Place::Here(unanswered),
            }
        }
        match &mut self.place {
            Place::Here(jobs) => jobs.pop_front().map(|job| decode(job, &self.limits)),
            Place::Elsewhere(_) => None,
            #[cfg(not(target_arch = "wasm32"))]
            Place::Thread(thread) => thread.poll(),
        }
    }
}

fn decode(job: Job, limits: &Limits) -> Decoded {
    let (result, decode_ms) = measured(&job.update.bytes, limits);
    job.decoded(result.map_err(|error| error.to_string()), decode_ms)
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
