//! Whether pictures are antialiased while the view changes: where asked for, or as long as frames come in time with it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
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
    /// Several as long as frames come in time; where they do not, one while the view changes. At rest, all that a pixel shows.
    Measured,
}

impl Antialias {
    /// Whether pictures are antialiased at rest at least.
    pub fn is_wanted(self) -> bool {
        self != Antialias::Off
    }
}

/// A frame that takes longer is slow: twenty a second are the fewest that look like motion.
const SLOW: Duration = Duration::from_millis(50);
/// So many slow frames one after the other are no accident: the first ones wait for shaders.
const SLOW_FRAMES: u32 = 4;

/// How long the device works at frames of several samples a pixel.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameTimes {
    /// Slow frames one after the other; it stays once there were [`SLOW_FRAMES`].
    slow: Arc<AtomicU32>,
}

impl FrameTimes {
    /// A frame of several samples a pixel was submitted just now.
    pub(crate) fn submitted(&self, gpu: &Gpu) {
        let (begin, slow) = (Instant::now(), Arc::clone(&self.slow));
        gpu.queue.on_submitted_work_done(move || FrameTimes { slow }.took(begin.elapsed()));
    }

    fn took(&self, time: Duration) {
        if self.is_too_slow() {
            return;
        }
        let slow = if time > SLOW { self.slow.load(Ordering::Relaxed) + 1 } else { 0 };
        self.slow.store(slow, Ordering::Relaxed);
    }

    /// Whether frames did not come in time.
    pub(crate) fn is_too_slow(&self) -> bool {
        self.slow.load(Ordering::Relaxed) >= SLOW_FRAMES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_slow_frames_in_a_row_end_it_and_single_ones_do_not() {
        let times = FrameTimes::default();
        for _ in 0..10 {
            (1..SLOW_FRAMES).for_each(|_| times.took(2 * SLOW));
            times.took(SLOW / 2);
        }
        assert!(!times.is_too_slow());
        (0..SLOW_FRAMES).for_each(|_| times.took(2 * SLOW));
        assert!(times.is_too_slow());
        times.took(SLOW / 2);
        assert!(times.is_too_slow(), "with one sample they come in time, with several they would not");
    }
}
