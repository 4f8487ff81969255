//! Decoding updates away from the picture, and building the surfaces of what they add, which takes longer.
//!
//! Natively a thread decodes, so that a large update never holds up a frame; in the browser a web worker does, which shares no
//! memory with the page ([`elsewhere`]). Where results must not depend on the machine's speed, and where there is no worker, one
//! update is decoded a call, between two frames, and whoever draws builds its surfaces. Updates stay in order in every place.

mod elsewhere;
mod job;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use protocol::Limits;
use protocol::session::ReceivedUpdate;
use surface::{Build, BuiltSurfaces};
use web_time::Instant;

use elsewhere::Elsewhere;
pub use elsewhere::{DecodeWorker, answer_in_parts};
pub use job::Decoded;
use job::{Job, measured};

/// See the module.
#[derive(Debug)]
pub struct Decoder {
    limits: Limits,
    /// `None` where nothing is drawn.
    build: Option<Build>,
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
        Decoder { limits, build: None, place: Place::Here(VecDeque::new()) }
    }

    /// Decodes on a thread of its own, which calls `wake` after each update.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn on_thread(limits: Limits, wake: std::sync::Arc<dyn Fn() + Send + Sync>) -> std::io::Result<Decoder> {
        let place = Place::Thread(thread::DecodeThread::start(limits.clone(), wake)?);
        Ok(Decoder { limits, build: None, place })
    }

    /// Decodes by a worker; where it fails, as [`Decoder::inline`] does, beginning with what the worker has not answered.
    pub fn elsewhere(limits: Limits, worker: Box<dyn DecodeWorker>) -> Decoder {
        Decoder { limits, build: None, place: Place::Elsewhere(Elsewhere::new(worker)) }
    }

    /// Whether another thread or a worker decodes, so that no frame waits for it.
    pub fn is_beside(&self) -> bool {
        !matches!(self.place, Place::Here(_))
    }

    /// How surfaces are built of what comes in from now on, where that is done beside the drawing.
    pub fn set_build(&mut self, build: Build) {
        self.build = Some(build);
    }

    /// Takes an update in. What may wait is bounded by the credit that the server has.
    pub fn push(&mut self, session: u64, update: ReceivedUpdate) {
        let job = Job { session, update, build: self.build };
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
    job.decoded(result.map_err(|error| error.to_string()), decode_ms, BuiltSurfaces::default())
}

#[cfg(not(target_arch = "wasm32"))]
mod thread {
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, Sender, channel};

    use protocol::Limits;

    use super::{Decoded, Job, decode};

    fn decode_and_build(job: Job, limits: &Limits) -> Decoded {
        let build = job.build;
        let mut decoded = decode(job, limits);
        if let (Some(build), Ok(update)) = (build, &decoded.result) {
            decoded.built = build.surfaces(update).collect();
        }
        decoded
    }

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
                    if decoded_in.send(decode_and_build(job, &limits)).is_err() {
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
