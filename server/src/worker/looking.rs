//! A thread that looks for what clients lack.
//!
//! What a turn does wrong ends that turn alone. After a panic the stage may be left half done, and after an error of its imager the GPU's device may be lost: it is
//! made anew then, and the thread goes on. Clients whose copies lie on a device that was lost begin anew when their turn comes.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use super::turn::{NotServed, Reply, Served, Turn, Unencoded, Wish};
use crate::client::Client;
use crate::fault::{Fault, caught};
use crate::frame::{Made, Stage};
use crate::look_times;
use crate::queue::Queue;
use crate::stage_error::StageError;
use crate::stats::Stats;
use crate::viewer::Viewer;

/// Work that nobody waits for takes one part in so many of the time at most, while there are turns to take.
const PARTS_FOR_TURNS: u32 = 20;
/// After so many failures without a turn between them that went well nothing can be drawn any more.
const MOST_FAILURES: u32 = 16;
/// How long is waited before the first stage that follows one made anew is made anew itself; twice as long before each further one, as a driver may take a while to be back.
const FIRST_PAUSE: Duration = Duration::from_millis(10);
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

/// See the module.
pub(super) struct Looking<'a> {
    pub stage: Stage,
    /// Whether this thread does what nobody waits for: whatever it judges, all know.
    pub works_aside: bool,
    pub queue: &'a Queue<Turn>,
    pub waiting: &'a AtomicUsize,
    pub encoder: &'a mpsc::SyncSender<Unencoded>,
    pub stats: &'a Stats,
    /// Failures without a turn between them that went well.
    pub failures: u32,
}

/// A client whose copy may have been drawn in part, by what is made anew now: it is sent it anew.
fn keeps(mut client: Box<Client>, reply: Reply, fault: Fault) -> Turned {
    client.start_anew();
    drop(reply.send(Ok(Served { client, update: None })));
    Turned::Badly(fault)
}

/// What a turn came to.
enum Turned {
    Well,
    /// There is no encoder any more.
    Closed,
    /// The stage is to be made anew.
    Badly(Fault),
}

impl Looking<'_> {
    /// Takes turns until there are none any more, or nothing can be drawn.
    pub fn run(&mut self) -> Result<(), Fault> {
        let mut aside_from = Instant::now();
        loop {
            let (next, begun) = (self.queue.try_next(), Instant::now());
            if self.works_aside && (next.is_none() || begun >= aside_from) {
                let has_worked = self.work_aside()?;
                aside_from = Instant::now() + begun.elapsed() * PARTS_FOR_TURNS;
                if has_worked && next.is_none() {
                    continue;
                }
            }
            let Some(turn) = next.or_else(|| self.queue.next()) else { return Ok(()) };
            let turned = self.take(turn);
            self.waiting.fetch_sub(1, Ordering::Relaxed);
            match turned {
                Turned::Well => self.failures = 0,
                Turned::Closed => return Ok(()),
                Turned::Badly(fault) => self.renew(fault)?,
            }
        }
    }

    /// Whether there was anything to do. What fails is not tried again: nobody waits for it.
    fn work_aside(&mut self) -> Result<bool, Fault> {
        let fault = match caught(|| self.stage.work_aside()) {
            Ok(Ok(has_worked)) => return Ok(has_worked),
            Ok(Err(error)) => Fault::new(error),
            Err(fault) => fault,
        };
        self.stats.count_fault(&fault);
        self.works_aside = false;
        self.renew(fault)?;
        Ok(false)
    }

    fn take(&mut self, turn: Turn) -> Turned {
        let Turn { wish, look, mut client, reply, queued } = turn;
        if reply.is_closed() {
            return Turned::Well; // The client left while it waited.
        }
        let (viewer, now_s) = look();
        let started = Instant::now();
        self.stage.waited(&mut client, (started - queued).as_secs_f64());
        let made = caught(|| self.made(wish, &viewer, &mut client, now_s));
        self.stats.look_times.count(look_times::take(started.elapsed()));
        match made {
            Ok(Ok(None)) => drop(reply.send(Ok(Served { client, update: None }))),
            Ok(Ok(Some(made))) => {
                let sent = self.encoder.send(Unencoded { made, look: started.elapsed(), client, reply });
                return if sent.is_ok() { Turned::Well } else { Turned::Closed };
            }
            Ok(Err(StageError::Held(error))) => self.fails(Fault::new(error), reply),
            Ok(Err(StageError::Imager(error))) => return keeps(client, reply, Fault::new(error)),
            // A panic is also how some of what is asked of a lost device ends.
            Err(fault) if self.stage.is_lost() => return keeps(client, reply, fault),
            // What came of it may be the client's own doing, so that it would be the same again: its session ends.
            Err(fault) => {
                self.fails(fault.clone(), reply);
                return Turned::Badly(fault);
            }
        }
        Turned::Well
    }

    fn made(
        &mut self,
        wish: Wish,
        viewer: &Viewer,
        client: &mut Client,
        now_s: f64,
    ) -> Result<Option<Made>, StageError> {
        self.stage.takes(client);
        match self.stage.update(viewer, client, now_s) {
            // Its own turn counts as one that waits.
            Ok(None) if wish == Wish::Next && self.waiting.load(Ordering::Relaxed) <= 1 => {
                self.stage.anticipate(viewer, client, now_s)
            }
            made => made,
        }
    }

    /// A turn comes to nothing.
    fn fails(&self, fault: Fault, reply: Reply) {
        self.stats.count_fault(&fault);
        drop(reply.send(Err(NotServed::Fault(fault))));
    }

    /// Makes the stage anew; an error where there is no other, or none that works.
    fn renew(&mut self, mut fault: Fault) -> Result<(), Fault> {
        loop {
            self.failures += 1;
            if self.failures > MOST_FAILURES {
                return Err(fault);
            }
            tracing::error!("what draws is made anew after {fault}");
            if self.failures > 1 {
                std::thread::sleep((FIRST_PAUSE * 2_u32.saturating_pow(self.failures - 2)).min(LONGEST_PAUSE));
            }
            match caught(|| self.stage.anew()) {
                Ok(Ok(Some(stage))) => {
                    self.stage = stage;
                    self.stats.renewals.fetch_add(1, Ordering::Relaxed);
                    return Ok(());
                }
                // It has nothing that could be left half done.
                Ok(Ok(None)) => return Ok(()),
                Ok(Err(error)) => fault = Fault::new(error),
                Err(panic) => fault = panic,
            }
        }
    }
}
