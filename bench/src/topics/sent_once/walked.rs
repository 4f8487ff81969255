//! What a walk comes to.

use std::sync::Arc;

use client::draw::frame::Options;
use gpu::Gpu;
use scene::Scene;

use super::walk::{Setup, Tick, UPDATE_HZ, Walk, Walker};
use crate::client_view::ClientView;
use crate::compare::score;
use crate::stage::{Stage, picture};
use crate::topics::reconstruction::cover;

/// Seconds of standing before and after the walk.
pub(super) const STAND_S: f64 = 1.0;
/// Every so many ticks the client's view is judged.
const JUDGED_EVERY: usize = 5;

/// See the module.
pub(super) struct Walked {
    pub ticks: Vec<Tick>,
    pub holes: Vec<f64>,
    pub false_cover: Vec<f64>,
    pub flip: Vec<f64>,
    /// Samples held, and wall milliseconds of a client's frame.
    pub frames: Vec<(usize, f64)>,
}

pub(super) fn walked(
    gpu: &Gpu,
    scene: &Arc<Scene>,
    setup: &Setup,
    walk: &Walk,
    truths: &mut Stage,
) -> anyhow::Result<Walked> {
    let near_m = server::start::near_m(scene);
    let mut walker = Walker::new(gpu, scene.clone(), setup)?;
    let mut view = ClientView::new(gpu, (setup.output_px, setup.output_px))?;
    let mut walked =
        Walked { ticks: Vec::new(), holes: Vec::new(), false_cover: Vec::new(), flip: Vec::new(), frames: Vec::new() };
    let steps = ((2.0 * walk.half_s + 2.0 * STAND_S) * UPDATE_HZ).round() as usize;
    let pose = |step: usize| walk.at((step as f64 / UPDATE_HZ - STAND_S).clamp(0.0, 2.0 * walk.half_s));
    for step in 0..steps {
        let now_s = step as f64 / UPDATE_HZ;
        walked.ticks.push(walker.tick(pose(step), now_s)?);
        if step % JUDGED_EVERY == JUDGED_EVERY - 1 {
            let output = walker.output(pose(step + 1), near_m);
            truths.show(now_s, output.world_from_eye.translation)?;
            let truth = truths.truth(&output)?;
            let drawn = view.frame_reflecting(&walker.set, Some(&walker.impostors), &output, Options::default())?;
            walked.frames.push((walker.set.held.sample_count(), drawn.frame_ms));
            let verdicts = cover::verdicts(&truth, &drawn.w, &output, &[]);
            let Some(shares) = cover::shares(&verdicts, &truth) else { continue };
            walked.holes.push(shares.holes);
            walked.false_cover.push(shares.false_cover);
            walked.flip.extend(score(&drawn.picture, &picture(&truth), None)?.flip_covered);
        }
    }
    Ok(walked)
}
