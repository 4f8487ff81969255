//! How large the images of a viewer who moves are: as large as the path carries, and the server has time for.
//!
//! Credit alone makes updates rarer on a slow path, and each then shows where the viewer was. What comes into view is rather sampled more
//! coarsely, so that an update takes about an interval to get through, and again when the viewer stands still: coarse before fine.

use crate::allowance::Allowance;
use crate::viewer::Viewer;

/// Of the side of the largest images; the least is what still makes a picture.
const SIDE_SHARES: [f64; 4] = [1.0, std::f64::consts::FRAC_1_SQRT_2, 0.5, 0.25];
/// Who is sent little is delivered little, whatever the path could carry. So the next update may be so many times as large as the throughput
/// says where the last one took less than an interval over this longer than the fastest one did: it then takes an interval at most.
const GROWTH: f64 = 2.0;
/// Who waits for his turn longer than so many intervals gets smaller images at the next one, and larger ones where he hardly waits at all.
const LONG_WAIT_INTERVALS: f64 = 2.0;
const SHORT_WAIT_INTERVALS: f64 = 0.5;
/// How far images shrink under load, of [`SIDE_SHARES`]. Fifty walkers among `pillars` on two cores, images of 256 pixels at most and one a look, runs of 30
/// seconds: with two steps 31 updates a second in all, 99 of 100 intervals within 2.1 s, an error (FLIP over covered pixels) of 0.09 and 950 MiB; with three
/// 51, 1.8 s, 0.11 and 620 MiB. With three images a look and two steps it was 11, 8.4 s and 0.25 to 0.34.
const MOST_STEPS: usize = 3;
/// What a pixel costs before anything is known of it, in bytes: as much as in a first set, of which the one half shows what another image holds.
const NEW_BYTES_PER_PX: f64 = 1.5;
/// Share of a new update in what a pixel is expected to cost.
const SMOOTHING: f64 = 0.25;

/// What a server has time for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The side of the next images as a share of the largest.
    pub side_share: f64,
}

impl Load {
    /// No viewer waits for another.
    pub const NONE: Load = Load { side_share: 1.0 };

    /// Whether less is to be done for each viewer.
    pub fn is_heavy(&self) -> bool {
        self.side_share < 1.0
    }

    /// How many images there is time for, of so many: then only one, from where the viewer is expected. What it leaves out, the next one shows, and that
    /// comes the sooner.
    pub fn images(&self, images: usize) -> usize {
        if self.is_heavy() { 1 } else { images }
    }
}

/// What the updates of one client came to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    /// Bytes of an update over the pixels of the views that it was made from; `None` before any.
    bytes_per_px: Option<f64>,
    /// Which of [`SIDE_SHARES`] the server has time for.
    load_step: usize,
}

impl Pace {
    /// The client waited so long for its turn. All who wait for each other wait about as long, so images shrink for all of them.
    pub fn waited(&mut self, wait_s: f64, interval_s: f64) {
        if wait_s > LONG_WAIT_INTERVALS * interval_s {
            self.load_step = (self.load_step + 1).min(MOST_STEPS);
        } else if wait_s < SHORT_WAIT_INTERVALS * interval_s {
            self.load_step = self.load_step.saturating_sub(1);
        }
    }

    /// What there is time for, by what waiting said.
    pub fn load(&self) -> Load {
        Load { side_share: SIDE_SHARES[self.load_step] }
    }

    /// An update for a viewer who moves was made from views of so many pixels together. One that was made from none says nothing of what views cost.
    pub fn made(&mut self, bytes: usize, pixels: u64) {
        if pixels == 0 {
            return;
        }
        let cost = bytes as f64 / pixels as f64;
        self.bytes_per_px = Some(self.bytes_per_px.map_or(cost, |old| old + SMOOTHING * (cost - old)));
    }

    /// The side of the next images as a share of the largest, when views of that have so many pixels together: by what the path carries in an update interval, or by what an
    /// update may bring where nothing is known yet. Sides come in few steps: views of one size share their targets.
    pub fn side_share(&self, pixels: u64, viewer: &Viewer, interval_s: f64, allowance: Allowance) -> f64 {
        let (bytes_per_px, carried_bytes) = match (self.bytes_per_px, viewer.bytes_per_s) {
            (Some(bytes_per_px), Some(bytes_per_s)) => {
                let growth = if viewer.queue_s < interval_s / GROWTH { GROWTH } else { 1.0 };
                (bytes_per_px, (bytes_per_s * growth).max(1.0) * interval_s)
            }
            _ => (NEW_BYTES_PER_PX, allowance.bytes()),
        };
        let fits = |share: &&f64| bytes_per_px * pixels as f64 * share.powi(2) <= carried_bytes;
        *SIDE_SHARES.iter().find(fits).unwrap_or(&SIDE_SHARES[SIDE_SHARES.len() - 1])
    }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use protocol::message::ViewSize;

    use super::*;

    #[test]
    fn images_are_as_large_as_the_path_carries_in_an_interval() {
        let mut pace = Pace::default();
        let pixels = 3 * 512 * 512;
        let view = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };
        let share = |pace: &Pace, bytes_per_s, queue_s| {
            let mut viewer = Viewer::at_start(view, Rigid::IDENTITY, 0.0);
            (viewer.bytes_per_s, viewer.queue_s) = (bytes_per_s, queue_s);
            pace.side_share(pixels, &viewer, 0.1, Allowance::ALL)
        };
        assert_eq!(share(&pace, Some(1.0), 0.05), 1.0, "nothing is known of what updates cost");
        let unknown = Viewer::at_start(view, Rigid::IDENTITY, 0.0);
        let carrying = |bytes_per_s| {
            let mut viewer = unknown;
            viewer.bytes_per_s = Some(bytes_per_s);
            viewer
        };
        let slow = Allowance::of(&carrying(170e3));
        assert_eq!(pace.side_share(pixels, &unknown, 0.1, slow), 0.25, "128 KiB for 786,432 pixels");
        pace.made(50_000, pixels);
        assert_eq!(share(&pace, None, 0.05), 1.0, "nothing is known of the path");
        let rates = [500e3, 499e3, 251e3, 125e3, 1.0, 0.0];
        let full = [1.0, SIDE_SHARES[1], SIDE_SHARES[1], 0.5, 0.25, 0.25];
        assert_eq!(rates.map(|rate| share(&pace, Some(rate), 0.05)), full);
        assert_eq!(
            rates.map(|rate| share(&pace, Some(rate / 2.0), 0.049)),
            full,
            "what was not full may carry twice as much"
        );
    }

    #[test]
    fn who_waits_gets_smaller_images_until_he_does_not() {
        let mut pace = Pace::default();
        let shares = [0.05, 0.3, 0.3, 0.3, 0.1, 0.04, 0.04, 0.04].map(|wait_s| {
            pace.waited(wait_s, 0.1);
            pace.load().side_share
        });
        let [whole, less, half, least] = SIDE_SHARES;
        assert_eq!(shares, [whole, less, half, least, least, half, less, whole]);
    }

    #[test]
    fn the_cost_of_a_pixel_follows_the_updates() {
        let mut pace = Pace::default();
        pace.made(1_000_000, 1_000_000);
        for _ in 0..40 {
            pace.made(10_000, 1_000_000);
        }
        let bytes_per_px = pace.bytes_per_px.expect("updates were made");
        assert!((bytes_per_px - 0.01).abs() < 1e-4, "{bytes_per_px}");
        pace.made(1, 0);
        assert!(pace.bytes_per_px.is_some_and(f64::is_finite));
    }
}
