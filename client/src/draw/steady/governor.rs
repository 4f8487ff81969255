//! Decides, by how long the device works at frames, whether each is drawn anew as a whole, or shows the last key picture while the next one is drawn
//! in slices; and how fine key pictures are.

use std::time::Duration;

/// Frames that take longer are too few a second to look like motion; antialiasing and what only comes in time are given up before.
const SLOW: Duration = Duration::from_millis(55);
/// So many of the least one after the other ...
const SLOW_FRAMES: u32 = 4;
/// ... or at least two of any kind that together take so long: the first ones wait for shaders, but not for that long.
const VERY_SLOW: Duration = Duration::from_millis(400);
/// A key picture that takes no longer could be every frame: 30 a second.
const FAST: Duration = Duration::from_millis(33);
/// So many of them one after the other are no accident.
const FAST_KEYS: u32 = 4;
/// Where frames of a key picture's slices take longer than the most, the next ones fall into more slices, and into fewer where they take less than the least.
const MOST_SLICE: Duration = Duration::from_millis(60);
const LEAST_SLICE: Duration = Duration::from_millis(35);
/// Slices of a key picture at most, and of the first one: one that comes later is not worth drawing.
const MOST_SLICES: usize = 8;
/// Pixels of a key picture for one of the output, along each side.
const SHARES: [f64; 4] = [1.0, 0.75, 0.5, 0.375];
/// The first key picture's.
const FIRST_SHARE: usize = 2;
/// Lighting a key picture is one frame's work: where it takes so much longer than a slice, and longer than the most, the next ones are coarser, and finer where it
/// takes less than the least.
const LIGHT_OVER_SLICE: u32 = 3;
const MOST_LIGHT: Duration = Duration::from_millis(100);
const LEAST_LIGHT: Duration = Duration::from_millis(20);

/// What a frame drew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Work {
    /// Everything. Frames are the least that there is where nothing else can be given up to make them faster.
    Whole {
        /// Whether this one is.
        is_least: bool,
    },
    /// A slice of a key picture.
    Slice,
    /// The light of a key picture, which ends it.
    Light,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct Governor {
    by_keys: bool,
    /// Slow frames one after the other, those of them that were the least, and what they took.
    slow: u32,
    slow_least: u32,
    slow_time: Duration,
    /// Of a key picture.
    slices: usize,
    share: usize,
    /// How many slices of this key picture were drawn, and what they took.
    drawn: u32,
    drawn_in: Duration,
    fast_keys: u32,
}

impl Governor {
    /// Whether it begins by key pictures, or with whole ones.
    pub(crate) fn new(by_keys: bool) -> Governor {
        Governor {
            by_keys,
            slow: 0,
            slow_least: 0,
            slow_time: Duration::ZERO,
            slices: MOST_SLICES,
            share: FIRST_SHARE,
            drawn: 0,
            drawn_in: Duration::ZERO,
            fast_keys: 0,
        }
    }

    /// Whether frames show key pictures.
    pub(crate) fn is_by_keys(&self) -> bool {
        self.by_keys
    }

    /// Pixels of a key picture for one of the output, along each side.
    pub(crate) fn share(&self) -> f64 {
        SHARES[self.share]
    }

    /// Slices of a key picture.
    pub(crate) fn slices(&self) -> usize {
        self.slices
    }

    /// The device took so long for a frame.
    pub(crate) fn took(&mut self, work: Work, time: Duration) {
        match work {
            Work::Whole { is_least } => self.took_whole(time, is_least),
            Work::Slice => {
                self.drawn += 1;
                self.drawn_in += time;
            }
            Work::Light => self.took_key(time),
        }
    }

    fn took_whole(&mut self, time: Duration, is_least: bool) {
        if time <= SLOW {
            (self.slow, self.slow_least, self.slow_time) = (0, 0, Duration::ZERO);
            return;
        }
        self.slow += 1;
        self.slow_least += u32::from(is_least);
        self.slow_time += time;
        if self.slow_least >= SLOW_FRAMES || self.slow > 1 && self.slow_time >= VERY_SLOW {
            *self = Governor::new(true);
        }
    }

    fn took_key(&mut self, light: Duration) {
        let (drawn, drawn_in) = (std::mem::take(&mut self.drawn).max(1), std::mem::take(&mut self.drawn_in));
        if drawn_in > MOST_SLICE * drawn {
            self.slices = (self.slices + 1).min(MOST_SLICES);
        } else if drawn_in < LEAST_SLICE * drawn {
            self.slices = (self.slices - 1).max(1);
        }
        if light > MOST_LIGHT && light * drawn > LIGHT_OVER_SLICE * drawn_in {
            self.share = (self.share + 1).min(SHARES.len() - 1);
        } else if light < LEAST_LIGHT {
            self.share = self.share.saturating_sub(1);
        }
        self.fast_keys = if drawn_in + light <= FAST && self.share == 0 { self.fast_keys + 1 } else { 0 };
        if self.fast_keys >= FAST_KEYS {
            *self = Governor::new(false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: Work = Work::Whole { is_least: true };
    const MS: Duration = Duration::from_millis(1);

    /// Draws frames on a device that takes so long for all surfaces, and for the light of a picture of full size; which frames had a new picture.
    fn frames(governor: &mut Governor, count: usize, (surfaces, light): (Duration, Duration)) -> Vec<bool> {
        let mut drawn = 0;
        let mut frame = || {
            if !governor.is_by_keys() {
                governor.took(WHOLE, surfaces + light);
                return true;
            }
            if drawn < governor.slices() {
                drawn += 1;
                governor.took(Work::Slice, surfaces / governor.slices() as u32);
                return false;
            }
            drawn = 0;
            governor.took(Work::Light, light.mul_f64(governor.share().powi(2)));
            true
        };
        (0..count).map(|_| frame()).collect()
    }

    #[test]
    fn what_comes_in_time_is_drawn_whole_and_single_slow_frames_change_nothing() {
        let mut governor = Governor::new(false);
        for _ in 0..20 {
            governor.took(WHOLE, 2000 * MS);
            governor.took(WHOLE, 20 * MS);
        }
        for _ in 0..20 {
            governor.took(Work::Whole { is_least: false }, 60 * MS);
            governor.took(WHOLE, 60 * MS);
            governor.took(WHOLE, 20 * MS);
        }
        assert!(!governor.is_by_keys());
    }

    #[test]
    fn what_is_slow_comes_in_as_many_slices_as_frames_need() {
        let mut governor = Governor::new(false);
        frames(&mut governor, 2, (200 * MS, 200 * MS));
        assert!(governor.is_by_keys(), "two frames of 0.4 seconds are enough");
        frames(&mut governor, 200, (200 * MS, 200 * MS));
        assert!((4..=5).contains(&governor.slices()), "of 35 to 60 ms: {}", governor.slices());
        assert_eq!(governor.share(), 0.5, "light takes 50 ms");
        frames(&mut governor, 200, (2000 * MS, 200 * MS));
        assert_eq!(governor.slices(), MOST_SLICES);
    }

    #[test]
    fn light_that_takes_too_long_makes_pictures_coarser() {
        let mut governor = Governor::new(false);
        frames(&mut governor, 100, (100 * MS, 900 * MS));
        assert_eq!(governor.share(), 0.375);
    }

    #[test]
    fn a_device_that_is_fast_again_draws_whole_frames_again() {
        let mut governor = Governor::new(false);
        frames(&mut governor, 50, (300 * MS, 100 * MS));
        assert!(governor.is_by_keys());
        frames(&mut governor, 60, (10 * MS, 5 * MS));
        assert!(!governor.is_by_keys());
    }
}
