//! Sends what occludes, and keeps it as it is now.

use std::sync::Arc;

use protocol::{Ball, Purpose};
use scene::{Scene, Snapshot};

use super::kept::Kept;
use super::near::{Covered, Point, Receivers, points_of};
use crate::account::findings::Lacking;
use crate::account::{Account, Surroundings};
use crate::discretize::{Capture, DepthPrecision, Discretization};
use crate::imager::Imager;
use crate::render::{Blended, LeftOut};
use crate::stage_error::StageError;

/// Layers of a view that are looked at.
const LAYERS: usize = 3;
/// A reach spans so many pixels of a view at least: finer than occlusion changes.
const REACH_PX: f64 = 16.0;
/// The least side of a view.
const LEAST_PX: u32 = 128;

/// What serves the occluders of one client.
pub struct Serving<'a> {
    /// What is there.
    pub scene: &'a Scene,
    /// Where it is.
    pub snapshot: &'a Arc<Snapshot>,
    /// The tables, lights and poses.
    pub now: &'a Surroundings<'a>,
    /// Where its eye is.
    pub eye_world: glam::DVec3,
    /// What is further away occludes nothing, metres; above 0.
    pub reach_m: f64,
    /// The most side of a view.
    pub side_px: u32,
    /// What it may hold of occluders.
    pub most_samples: usize,
    /// What the client holds.
    pub account: &'a mut Account,
    /// Sees the scene.
    pub imager: &'a mut dyn Imager,
}

/// Sends a client what occludes for it and is not held, or what of that changed.
pub fn serve(mut serving: Serving<'_>, kept: &mut Kept) -> Result<(), StageError> {
    let (all, moved) = kept.bounds(serving.scene, serving.snapshot);
    let Some(ball) = Ball::new(all, serving.eye_world, serving.reach_m) else { return Ok(()) };
    let around = (ball, serving.reach_m);
    let is_first = kept.around.is_none();
    if moved || kept.around.replace(around) != Some(around) {
        let views = ball.views(LEAST_PX).len();
        let next = kept.due.front().copied().unwrap_or(0);
        kept.due = (0..views).map(|view| (next + view) % views).collect();
    }
    if kept.due.is_empty() {
        return Ok(());
    }
    serving.account.delete_moved(Purpose::Occluders, serving.now)?;
    let count = if is_first { kept.due.len() } else { 1 };
    let views: Vec<usize> = kept.due.drain(..count).collect();
    serving.look(&ball, &views)?;
    if serving.account.samples_for(Purpose::Occluders) > serving.most_samples {
        serving.account.remove_where(|purpose| purpose == Purpose::Occluders)?;
        *kept = Kept::default();
    }
    Ok(())
}

impl Serving<'_> {
    fn look(&mut self, ball: &Ball, views: &[usize]) -> Result<(), StageError> {
        let side_px = (2.0 * REACH_PX * ball.radius_m / self.reach_m).ceil() as u32;
        let side_px = side_px.clamp(LEAST_PX.min(self.side_px), self.side_px);
        let all = ball.views(side_px);
        // What reliefs and bodies show to the eye occludes like everything else: graph cameras see samples alone. What is bent is elsewhere by then.
        self.imager.leave_out(LeftOut { absent: self.account.shown_bent(), ..LeftOut::default() });
        self.imager.blend(Blended::CutOut);
        let mut captures: Vec<Capture> = Vec::new();
        for &view in views {
            let layers = [all[view]; LAYERS];
            captures.extend(self.imager.captures(self.snapshot, &layers, Discretization::DepthPeeling)?);
        }
        self.account.counts_mut().occluders.views += captures.len();
        let spacing_m = ball.distance_m() / all[0].focal_px;
        let mut receivers = Receivers::new(self.reach_m);
        let mut covered = Covered::new(self.account.held(), ball, spacing_m, &mut receivers);
        let points: Vec<Vec<(usize, Point)>> = captures.iter().map(|capture| points_of(capture, ball)).collect();
        points.iter().flatten().for_each(|(_, point)| receivers.add(*point));
        for (capture, points) in captures.iter().zip(points) {
            let cells = receivers.occluded_by(points.iter().map(|(_, point)| *point));
            let occludes = |point: &Point| cells.contains(&receivers.cell(point.place));
            let is_lacking = |(_, point): &(usize, Point)| occludes(point) && !covered.has(*point);
            let lacking: Vec<(usize, Point)> = points.into_iter().filter(is_lacking).collect();
            self.add(capture, &lacking)?;
            lacking.into_iter().for_each(|(_, point)| covered.add(point));
        }
        Ok(())
    }

    fn add(&mut self, capture: &Capture, points: &[(usize, Point)]) -> Result<(), StageError> {
        let mut is_sent = vec![false; capture.ids.len()];
        points.iter().for_each(|(index, _)| is_sent[*index] = true);
        let send = capture.mask_where(|index| is_sent[index]);
        let lacking = Lacking { missing: points.len(), send, replaced: Vec::new() };
        Ok(self.account.add(Purpose::Occluders, capture, &lacking, DepthPrecision::Finest, self.now)?)
    }
}
