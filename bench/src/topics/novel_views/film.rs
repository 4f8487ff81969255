//! Films: what was shown, video of the same bytes, and the truth, side by side and as fast as they were seen.

use std::collections::BTreeMap;
use std::path::Path;

use super::ffmpeg;
use super::setup::CLIENT_HZ;
use super::truths::Pair;
use crate::compare::Picture;

/// A film has one of so many of the client's pictures.
const EVERY: usize = 4;
/// White between the sides.
const GAP_PX: u32 = 4;

/// Whether a picture is in films.
pub fn holds(frame: usize) -> bool {
    frame.is_multiple_of(EVERY)
}

/// Sides of a film, as runs give them, each picture by its frame.
#[derive(Default)]
pub struct Film {
    sides: Vec<BTreeMap<usize, Picture>>,
    truth: BTreeMap<usize, Picture>,
}

impl Film {
    /// Takes a run's pictures for the next side.
    pub fn add(&mut self, pairs: &[Pair], antialias: bool) {
        let of_film = || pairs.iter().filter(|pair| holds(pair.frame));
        self.sides.push(of_film().map(|pair| (pair.frame, pair.picture.clone())).collect());
        if self.truth.is_empty() {
            self.truth = of_film().map(|pair| (pair.frame, pair.truth.of(antialias).clone())).collect();
        }
    }

    /// Writes all sides, the truth last, as an animated WebP that begins again at its end.
    pub fn write(&self, tool: &Path, path: &Path) -> anyhow::Result<()> {
        let frame = |(frame, truth): (&usize, &Picture)| {
            let sides = self.sides.iter().map(|side| side.get(frame)).collect::<Option<Vec<_>>>()?;
            let all: Vec<&Picture> = sides.into_iter().chain([truth]).collect();
            Some(Picture::beside(&all, GAP_PX))
        };
        ffmpeg::animate(tool, self.truth.iter().filter_map(frame), CLIENT_HZ / EVERY as f64, path)
    }
}
