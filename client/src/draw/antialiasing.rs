//! Whether pictures are antialiased while the view changes: where asked for, or as long as frames come in time with it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use gpu::Gpu;
use web_time::Instant;

/// What is asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Antialias {
    /// One sample a pixel, always.
    #[default]
    Off,
    /// Several samples a pixel, always.
    On,
    /// Several once frames come in time with one, and as long as they do with several; else one while the view changes. At rest, all that a pixel shows.
    Measured,
}

impl Antialias {
    /// Whether pictures are antialiased at rest at least.
    pub fn is_wanted(self) -> bool {
        self != Antialias::Off
    }
}

/// Frames of one sample a pixel that take no longer come in time with several, too, as far as can be told without trying.
const FAST: Duration = Duration::from_millis(25);
/// A frame that takes longer is slow: twenty a second are the fewest that look like motion.
const SLOW: Duration = Duration::from_millis(50);
/// So many fast frames one after the other, or so many slow ones, are no accident: the first ones wait for shaders.
const FRAMES: u32 = 4;

/// How long the device works at frames.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameTimes(Arc<Mutex<Times>>);

/// Frames one after the other; a number stays once there were [`FRAMES`].
#[derive(Debug, Clone, Copy, Default)]
struct Times {
    /// Fast ones of one sample a pixel.
    fast: u32,
    /// Slow ones of several.
    slow: u32,
}

impl FrameTimes {
    /// A frame of one sample a pixel, or of several, was submitted just now.
    pub(crate) fn submitted(&self, gpu: &Gpu, several: bool) {
        let (begin, times) = (Instant::now(), self.clone());
        gpu.queue.on_submitted_work_done(move || times.took(begin.elapsed(), several));
    }

    fn took(&self, time: Duration, several: bool) {
        let mut times = self.lock();
        let (count, goes_on) = if several { (&mut times.slow, time > SLOW) } else { (&mut times.fast, time <= FAST) };
        if *count < FRAMES {
            *count = if goes_on { *count + 1 } else { 0 };
        }
    }

    /// Whether frames of several samples a pixel come in time: once those of one did, and until others did not.
    pub(crate) fn allow_several(&self) -> bool {
        let times = self.lock();
        times.fast >= FRAMES && times.slow < FRAMES
    }

    /// Whether further frames may change that.
    pub(crate) fn are_open(&self) -> bool {
        self.lock().slow < FRAMES
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Times> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_slow_frames_in_a_row_end_it_and_single_ones_do_not() {
        let times = FrameTimes::default();
        (0..FRAMES).for_each(|_| times.took(FAST / 2, false));
        for _ in 0..10 {
            (1..FRAMES).for_each(|_| times.took(2 * SLOW, true));
            times.took(SLOW / 2, true);
        }
        assert!(times.allow_several());
        (0..FRAMES).for_each(|_| times.took(2 * SLOW, true));
        assert!(!times.allow_several());
        times.took(SLOW / 2, true);
        assert!(!times.allow_several(), "with one sample they come in time, with several they would not");
    }

    #[test]
    fn it_begins_once_frames_are_fast_without_it() {
        let times = FrameTimes::default();
        for _ in 0..10 {
            (1..FRAMES).for_each(|_| times.took(FAST / 2, false));
            times.took(FAST * 2, false);
        }
        assert!(!times.allow_several());
        (0..FRAMES).for_each(|_| times.took(FAST / 2, false));
        assert!(times.allow_several());
    }
}
