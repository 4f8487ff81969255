//! The truth of a replay: the full scene at the poses and times of its pictures. Made once, shared by every run.

use std::collections::HashMap;
use std::sync::Arc;

use camera::{Pinhole, Rigid};
use gpu::Gpu;
use rayon::prelude::*;
use server::start::near_m;

use super::live::Shown;
use super::setup::{CLIENT_HZ, Replay};
use crate::compare::folder::FrameRow;
use crate::compare::{Picture, flicker, score};
use crate::stage::{Stage, picture};

/// Draws and keeps truths.
pub struct Truths {
    stage: Stage,
    view: Pinhole,
    /// By frame and, where the scene moves, by scene time.
    made: HashMap<(usize, u64), Arc<Picture>>,
}

impl Truths {
    /// None made yet.
    pub fn new(gpu: &Gpu, replay: &Replay) -> anyhow::Result<Truths> {
        let view = Pinhole::symmetric(Rigid::IDENTITY, replay.size_px, replay.fov_y_rad, near_m(&replay.scene));
        Ok(Truths { stage: Stage::new(gpu, replay.scene.clone(), replay.look)?, view, made: HashMap::new() })
    }

    /// A picture's truth, at its pose and at the scene's time when it was shown: what is late counts as error.
    pub fn of(&mut self, frame: usize, world_from_eye: Rigid, scene_time_s: f64) -> anyhow::Result<Arc<Picture>> {
        let animated = self.stage.scene.is_animated();
        let key = (frame, if animated { scene_time_s.to_bits() } else { 0 });
        if let Some(made) = self.made.get(&key) {
            return Ok(made.clone());
        }
        let camera = Pinhole { world_from_eye, ..self.view };
        self.stage.show(scene_time_s, world_from_eye.translation)?;
        let made = Arc::new(picture(&self.stage.truth(&camera)?));
        self.made.insert(key, made.clone());
        Ok(made)
    }

    /// The truth as another camera sees it at a time.
    pub fn from(&mut self, camera: &Pinhole, scene_time_s: f64) -> anyhow::Result<Picture> {
        self.stage.show(scene_time_s, camera.world_from_eye.translation)?;
        Ok(picture(&self.stage.truth(camera)?))
    }

    /// The pictures' camera, at the origin.
    pub fn view(&self) -> Pinhole {
        self.view
    }
}

/// A picture beside its truth.
pub struct Pair {
    /// Its number in the trace.
    pub frame: usize,
    /// As shown.
    pub picture: Picture,
    /// As it should be.
    pub truth: Arc<Picture>,
    /// Share of all pixels without a sample.
    pub uncovered_share: Option<f64>,
}

/// A run's pictures with their truths.
pub fn paired(truths: &mut Truths, shown: Vec<Shown>) -> anyhow::Result<Vec<Pair>> {
    let pair = |Shown { row, picture }: Shown| {
        let scene_time_s = row.scene_time_s + row.age_ms.unwrap_or(0.0) / 1e3;
        let truth = truths.of(row.frame, row.world_from_eye, scene_time_s)?;
        Ok(Pair { frame: row.frame, picture, truth, uncovered_share: Some(row.uncovered_share) })
    };
    shown.into_iter().map(pair).collect()
}

/// Scores pictures. Flicker is known where the picture before is there too.
pub fn scored(pairs: &[Pair]) -> anyhow::Result<Vec<FrameRow>> {
    let one = |(index, pair): (usize, &Pair)| {
        let before = index.checked_sub(1).map(|before| &pairs[before]).filter(|before| before.frame + 1 == pair.frame);
        let flicker =
            before.map(|before| flicker((&before.picture, &pair.picture), (&before.truth, &pair.truth))).transpose()?;
        Ok(FrameRow {
            frame: pair.frame as u32,
            scores: score(&pair.picture, &pair.truth, None)?,
            flicker,
            flip_16x: None,
            uncovered_share: pair.uncovered_share,
        })
    };
    pairs.par_iter().enumerate().map(one).collect()
}

/// When a frame is shown, from the trace's beginning.
pub fn shown_at_s(frame: usize) -> f64 {
    frame as f64 / CLIENT_HZ
}
