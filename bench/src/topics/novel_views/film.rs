//! Films: what was shown, video of the same bytes, and the truth, side by side and as fast as they were seen.

use std::path::Path;

use super::ffmpeg;
use super::setup::CLIENT_HZ;
use super::truths::Pair;
use crate::compare::Picture;

/// Of the client's pictures every so manieth is in a film.
const EVERY: usize = 4;
/// White between the sides.
const GAP_PX: u32 = 4;

/// The pictures that a run with a film scores: those of the film, and a neighbour of each.
pub fn scored_frames(frame: usize) -> bool {
    frame % EVERY < 2
}

/// Sides of a film, as runs give them.
#[derive(Default)]
pub struct Film {
    sides: Vec<Vec<Picture>>,
    truth: Vec<Picture>,
}

impl Film {
    /// Takes a run's pictures for the next side.
    pub fn add(&mut self, pairs: &[Pair], antialias: bool) {
        let of_film = || pairs.iter().filter(|pair| pair.frame.is_multiple_of(EVERY));
        self.sides.push(of_film().map(|pair| pair.picture.clone()).collect());
        if self.truth.is_empty() {
            self.truth = of_film().map(|pair| pair.truth.of(antialias).clone()).collect();
        }
    }

    /// Writes all sides, the truth last, as an animated WebP that begins again at its end.
    pub fn write(self, tool: &Path, path: &Path) -> anyhow::Result<()> {
        let Film { mut sides, truth } = self;
        sides.push(truth);
        let count = sides.iter().map(Vec::len).min().unwrap_or(0);
        let frame = |at: usize| Picture::beside(&sides.iter().map(|side| &side[at]).collect::<Vec<_>>(), GAP_PX);
        ffmpeg::animate(tool, &(0..count).map(frame).collect::<Vec<_>>(), CLIENT_HZ / EVERY as f64, path)
    }
}
