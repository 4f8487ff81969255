//! Decoding by a worker that shares no memory with the viewer: bytes go there, and answers ([`answer_in_parts`]) come back.
//!
//! The worker is not trusted to live. Every update is kept until its answer has been read, so one that dies, falls silent or
//! answers nonsense costs smoothness and nothing else: what it has not answered is decoded here.

use std::collections::VecDeque;
use std::fmt::Debug;

use protocol::{Limits, Update, plain};
use surface::{Build, Built, BuiltSurfaces, DamagedSurface, FarBytes};
use web_time::Instant;

use super::job::{Decoded, Job, measured};

/// A worker that owes an answer for this long counts as dead. Longer than the largest update takes on a slow machine.
pub(super) const PATIENCE_S: f64 = 30.0;
/// One look at the worker takes no more than this off the patience: a page that slept has not waited.
const LOOK_S: f64 = 1.0;

/// What decodes elsewhere, as whoever can start it hands it in.
pub trait DecodeWorker: Debug {
    /// Hands over the bytes of an update and a code of how surfaces are built of it, for [`answer_in_parts`] to be called with there.
    fn send(&mut self, bytes: &[u8], build: u8);
    /// The parts of the next answer, in the order of what was sent; `None` while there is none. An error says what the worker died of.
    fn receive(&mut self) -> Result<Option<Vec<Box<dyn FarBytes>>>, String>;
    /// The worker is given up, and why; it is asked no more. Tells who reads the log.
    fn give_up(&mut self, why: &str);
}

/// No surfaces are built.
const NO_BUILD: u8 = 0;

/// What a worker sends back for the bytes of an update, part by part, so that it never holds all of it. First comes one byte, 1 for an update and 0 for words about what
/// is wrong with it; eight of the milliseconds that decoding took (f64); then the update in its plain form, or the words. Then, if `build` is the code of a [`Build`], the
/// bytes of each surface.
pub fn answer_in_parts(bytes: &[u8], build: u8, limits: &Limits, mut hand_over: impl FnMut(Vec<u8>)) {
    let (result, decode_ms) = measured(bytes, limits);
    let mut answer = vec![u8::from(result.is_ok())];
    answer.extend(decode_ms.to_le_bytes());
    match &result {
        Ok(update) => plain::write_update(update, &mut answer),
        Err(error) => answer.extend(error.to_string().bytes()),
    }
    hand_over(answer);
    if let (Ok(update), Some(build)) = (&result, Build::from_code(build)) {
        build.surfaces(update).for_each(|built| hand_over(built.to_bytes()));
    }
}

/// What is in the first part of an answer: the update or what is wrong with it, and the milliseconds; or what is wrong with the answer.
pub(super) fn read_update(answer: &[u8]) -> Result<(Result<Update, String>, f64), String> {
    let (&kind, rest) = answer.split_first().ok_or("an empty answer")?;
    let (&decode_ms, rest) = rest.split_first_chunk().ok_or("an answer that ends early")?;
    let result = match kind {
        0 => Err(String::from_utf8_lossy(rest).into_owned()),
        1 => Ok(plain::read_update(rest).map_err(|error| format!("a damaged answer: {error}"))?),
        _ => return Err("an answer of unknown kind".to_owned()),
    };
    Ok((result, f64::from_le_bytes(decode_ms)))
}

/// A worker with what it owes.
#[derive(Debug)]
pub(super) struct Elsewhere {
    worker: Box<dyn DecodeWorker>,
    unanswered: VecDeque<Job>,
    silent_s: f64,
    looked_at: Option<Instant>,
}

impl Elsewhere {
    pub fn new(worker: Box<dyn DecodeWorker>) -> Elsewhere {
        Elsewhere { worker, unanswered: VecDeque::new(), silent_s: 0.0, looked_at: None }
    }

    pub fn push(&mut self, job: Job) {
        self.worker.send(&job.update.bytes, job.build.map_or(NO_BUILD, Build::code));
        self.unanswered.push_back(job);
    }

    /// The next decoded update, where there is one; or, where the worker had to be given up, all that it has not answered.
    pub fn poll(&mut self, now: Instant) -> Result<Option<Decoded>, VecDeque<Job>> {
        self.next(now).map_err(|why| {
            self.worker.give_up(&why);
            std::mem::take(&mut self.unanswered)
        })
    }

    fn next(&mut self, now: Instant) -> Result<Option<Decoded>, String> {
        let Some(answer) = self.worker.receive()? else {
            return self.wait(now).map(|()| None);
        };
        self.silent_s = 0.0;
        let mut parts = answer.into_iter();
        let first = parts.next().ok_or("an empty answer")?;
        let mut bytes = vec![0; first.count()];
        first.read(0, &mut bytes);
        let (result, decode_ms) = read_update(&bytes)?;
        let built: Result<BuiltSurfaces, DamagedSurface> = parts.map(Built::from_bytes).collect();
        let built = built.map_err(|error| format!("a damaged answer: {error}"))?;
        let job = self.unanswered.pop_front().ok_or("an answer to nothing")?;
        Ok(Some(job.decoded(result, decode_ms, built)))
    }

    fn wait(&mut self, now: Instant) -> Result<(), String> {
        let looked_at = self.looked_at.replace(now).unwrap_or(now);
        let since_s = now.saturating_duration_since(looked_at).as_secs_f64();
        self.silent_s = if self.unanswered.is_empty() { 0.0 } else { self.silent_s + since_s.min(LOOK_S) };
        if self.silent_s > PATIENCE_S { Err(format!("no answer for {PATIENCE_S} s")) } else { Ok(()) }
    }
}
