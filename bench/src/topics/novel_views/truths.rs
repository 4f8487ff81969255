//! The truth of a replay: the full scene at the poses and times of its pictures, with one sample a pixel and with sixteen. Made once, shared
//! by every run.

use std::collections::HashMap;
use std::sync::Arc;

use camera::{Pinhole, Rigid};
use gpu::Gpu;
use rayon::prelude::*;
use server::start::near_m;

use super::live::Shown;
use super::setup::{CLIENT_HZ, Replay};
use crate::compare::band::Shape;
use crate::compare::folder::FrameRow;
use crate::compare::{Picture, Regions, flicker, flip_means, score_regions};
use crate::stage::{Stage, picture};

/// What a viewer should have seen.
#[derive(Debug)]
pub struct Truth {
    /// One sample a pixel, at its centre.
    pub plain: Picture,
    /// Sixteen samples a pixel, averaged in linear light.
    pub smooth: Picture,
    /// The outline band of the plain one, a value a pixel.
    pub band: Vec<bool>,
}

impl Truth {
    /// The one that pictures with or without antialiasing are to look like.
    pub fn of(&self, antialias: bool) -> &Picture {
        if antialias { &self.smooth } else { &self.plain }
    }
}

/// Draws and keeps truths.
pub struct Truths {
    stage: Stage,
    view: Pinhole,
    antialias: bool,
    /// By frame and, where the scene moves, by scene time.
    made: HashMap<(usize, u64), Arc<Truth>>,
}

impl Truths {
    /// None made yet. `antialias`: whether pictures are to look like the smooth ones.
    pub fn new(gpu: &Gpu, replay: &Replay, antialias: bool) -> anyhow::Result<Truths> {
        let view = Pinhole::symmetric(Rigid::IDENTITY, replay.size_px, replay.fov_y_rad, near_m(&replay.scene));
        let stage = Stage::new(gpu, replay.scene.clone(), replay.look)?;
        Ok(Truths { stage, view, antialias, made: HashMap::new() })
    }

    /// A picture's truth, at its pose and at the scene's time when it was shown: what is late counts as error.
    pub fn of(&mut self, frame: usize, world_from_eye: Rigid, scene_time_s: f64) -> anyhow::Result<Arc<Truth>> {
        let animated = self.stage.scene.is_animated();
        let key = (frame, if animated { scene_time_s.to_bits() } else { 0 });
        if let Some(made) = self.made.get(&key) {
            return Ok(made.clone());
        }
        let camera = Pinhole { world_from_eye, ..self.view };
        self.stage.show(scene_time_s, world_from_eye.translation)?;
        let drawn = self.stage.truth(&camera)?;
        let (width_px, focal_px) = (camera.width_px as usize, camera.focal_px);
        let band = Shape { w: &drawn.w, object: &drawn.object, width_px, focal_px }.outline_band();
        let smooth = picture(&self.stage.smooth_truth(&camera)?);
        let made = Arc::new(Truth { plain: picture(&drawn), smooth, band });
        self.made.insert(key, made.clone());
        Ok(made)
    }

    /// The truth as another camera sees it at a time.
    pub fn from(&mut self, camera: &Pinhole, scene_time_s: f64) -> anyhow::Result<Picture> {
        self.stage.show(scene_time_s, camera.world_from_eye.translation)?;
        let drawn = if self.antialias { self.stage.smooth_truth(camera)? } else { self.stage.truth(camera)? };
        Ok(picture(&drawn))
    }

    /// Whether pictures are to look like the smooth truths.
    pub fn antialias(&self) -> bool {
        self.antialias
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
    pub truth: Arc<Truth>,
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

/// Scores pictures. Flicker is known where the picture before is there too; with antialiasing it is that against the smooth truth.
pub fn scored(pairs: &[Pair], antialias: bool) -> anyhow::Result<Vec<FrameRow>> {
    let one = |(index, pair): (usize, &Pair)| {
        let before = index.checked_sub(1).map(|before| &pairs[before]).filter(|before| before.frame + 1 == pair.frame);
        let flicker = before.map(|before| {
            flicker((&before.picture, &pair.picture), (before.truth.of(antialias), pair.truth.of(antialias)))
        });
        let Truth { plain, smooth, band } = &*pair.truth;
        let regions = Regions { covered: plain.covered.as_deref(), band: Some(band) };
        Ok(FrameRow {
            frame: pair.frame as u32,
            scores: score_regions(&pair.picture, plain, regions)?,
            flicker: flicker.transpose()?,
            flip_16x: Some(flip_means(&pair.picture, smooth, regions.covered, regions.band)?),
            uncovered_share: pair.uncovered_share,
        })
    };
    pairs.par_iter().enumerate().map(one).collect()
}

/// When a frame is shown, from the trace's beginning.
pub fn shown_at_s(frame: usize) -> f64 {
    frame as f64 / CLIENT_HZ
}
