//! Where the time of looks goes. A look is made on one thread, which adds up what its parts take until its turn ends.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A part of a look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Views of the scene: drawn, waited for, read back.
    Scene,
    /// The same views of the copy, and its meshes.
    Copy,
    /// Both laid beside each other, by the processor; on the GPU, what is said to it and what it said.
    Compare,
    /// Waiting for both to be drawn and compared on the GPU.
    Gpu,
    /// Edits made, and followed by the copy.
    Keep,
    /// All else: plans, snapshots, what is asked of shapes.
    Other,
    /// Bytes made of the edits, on a thread of its own.
    Encode,
}

impl Part {
    /// In the order of a look.
    pub const ALL: [Part; 7] =
        [Part::Scene, Part::Copy, Part::Compare, Part::Gpu, Part::Keep, Part::Other, Part::Encode];

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Part::Scene => "scene",
            Part::Copy => "copy",
            Part::Compare => "compare",
            Part::Gpu => "gpu",
            Part::Keep => "keep",
            Part::Other => "other",
            Part::Encode => "encode",
        }
    }
}

type Times = [Duration; Part::ALL.len()];

thread_local! {
    static TIMES: Cell<Times> = const { Cell::new([Duration::ZERO; Part::ALL.len()]) };
}

/// Does a part of this thread's look. Parts do not lie in each other.
pub(crate) fn timed<T>(part: Part, work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let done = work();
    let mut times = TIMES.get();
    times[part as usize] += started.elapsed();
    TIMES.set(times);
    done
}

/// What the parts of this thread's look took, of all that it took; the next look begins.
pub(crate) fn take(all: Duration) -> Times {
    let mut times = TIMES.replace(Times::default());
    times[Part::Other as usize] = all.saturating_sub(times.iter().sum());
    times
}

/// Sums over the looks of a server.
#[derive(Debug, Default)]
pub struct LookTimes {
    looks: AtomicU64,
    microseconds: [AtomicU64; Part::ALL.len()],
}

impl LookTimes {
    /// Counts a look that drew something.
    pub(crate) fn count(&self, times: Times) {
        if times[Part::Scene as usize].is_zero() {
            return;
        }
        self.looks.fetch_add(1, Ordering::Relaxed);
        Part::ALL.into_iter().for_each(|part| self.add(part, times[part as usize]));
    }

    /// Adds what a part took.
    pub(crate) fn add(&self, part: Part, took: Duration) {
        let took_us = u64::try_from(took.as_micros()).unwrap_or(u64::MAX);
        self.microseconds[part as usize].fetch_add(took_us, Ordering::Relaxed);
    }

    /// How many looks drew something.
    pub fn looks(&self) -> u64 {
        self.looks.load(Ordering::Relaxed)
    }

    /// What a part takes, in milliseconds a look; 0 before the first one.
    pub fn mean_ms(&self, part: Part) -> f64 {
        let all_us = self.microseconds[part as usize].load(Ordering::Relaxed) as f64;
        all_us / 1e3 / self.looks().max(1) as f64
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        let means = Part::ALL.into_iter().map(|part| (format!("{}_ms", part.name()), self.mean_ms(part).into()));
        let looks = std::iter::once(("looks".to_owned(), self.looks().into()));
        serde_json::Value::Object(looks.chain(means).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_and_the_rest_are_all_that_a_look_took() {
        let pause = Duration::from_millis(3);
        let started = Instant::now();
        assert_eq!(timed(Part::Scene, || std::thread::sleep(pause)), ());
        timed(Part::Keep, || ());
        timed(Part::Scene, || std::thread::sleep(pause));
        std::thread::sleep(pause);
        let all = started.elapsed();
        let times = take(all);
        assert_eq!(times.iter().sum::<Duration>(), all);
        assert!(times[Part::Scene as usize] >= 2 * pause && times[Part::Other as usize] >= pause, "{times:?}");
        let sums = LookTimes::default();
        sums.count(times);
        sums.count(take(Duration::ZERO));
        assert_eq!(sums.looks(), 1, "a turn in which nothing was drawn is no look");
        assert!(sums.mean_ms(Part::Scene) >= 6.0);
    }
}
