//! Layers of what is blended, see [`crate::render::Layer`]: sets of their own, seen by the views of the plan and kept by the account's rules.

use camera::{Bounds, ImageBounds, ImagePoint, Pinhole};
use glam::DVec2;
use protocol::Purpose;
use scene::Snapshot;

use super::{BYTES_PER_SAMPLE, Client, Stage, StageError};
use crate::account::Surroundings;
use crate::discretize::Discretization;
use crate::plan::Plan;
use crate::render::{Blended, Layer};

/// A layer may take this part of a client's budget.
const LAYERS_SHARE: u64 = 4;
/// Beside a box a pixel more is looked at on each side, for what ends there, and one for rounding.
const RIM_PX: f64 = 2.0;
/// Parts of views that move from look to look have few sizes.
const STEP_PX: f64 = 16.0;

impl Stage {
    /// Brings a client's layers up to date as the plan's views see them; a scene in which nothing is blended has none.
    pub(super) fn send_layers(
        &mut self,
        plan: &Plan,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
    ) -> Result<(), StageError> {
        for layer in self.imager.layers() {
            self.imager.blend(Blended::Layer(layer));
            self.send_layer(layer, plan, snapshot, now, client)?;
        }
        self.imager.blend(Blended::LeftOut);
        Ok(())
    }

    fn send_layer(
        &mut self,
        layer: Layer,
        plan: &Plan,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
    ) -> Result<(), StageError> {
        let purpose = Purpose::Layer(layer.0);
        let most_samples = (self.budget_bytes(client) / BYTES_PER_SAMPLE / LAYERS_SHARE) as usize;
        let account = &mut client.account;
        account.draw_with(purpose, || self.imager.new_surfaces());
        let Some(bounds) = self.imager.layer_bounds(snapshot, layer)? else { return Ok(()) };
        let parts = plan.views.iter().enumerate().filter_map(|(index, view)| Some((index, part(view, &bounds)?)));
        let (indices, parts): (Vec<usize>, Vec<Pinhole>) = parts.unzip();
        let captures = self.imager.captures(snapshot, &parts, Discretization::Conventional)?;
        for (index, mut capture) in indices.into_iter().zip(captures) {
            // Where the view shows nothing of it and none is held, nothing lacks and nothing is too much.
            if capture.hides.iter().any(|&hides| hides > 0) || account.samples_for(purpose) > 0 {
                self.look_from(index, &mut capture, plan, (purpose, now), account)?;
            }
        }
        Ok(account.evict_of(purpose, most_samples)?)
    }
}

/// The part of a view that shows a box, in whole steps of [`STEP_PX`]; `None` where it shows nothing of it.
fn part(view: &Pinhole, bounds: &Bounds) -> Option<Pinhole> {
    let corners = bounds.corners().map(|corner| view.image_from_world(corner));
    if corners.iter().all(Option::is_none) {
        // All of it is behind the eye.
        return None;
    }
    let corners: Option<Vec<ImagePoint>> = corners.into_iter().collect();
    // On both sides of the eye: the whole view.
    let Some(seen) = corners.and_then(ImageBounds::around) else { return Some(*view) };
    let size_px = DVec2::new(view.width_px.into(), view.height_px.into());
    let low = ((seen.min_px - RIM_PX) / STEP_PX).floor().max(DVec2::ZERO) * STEP_PX;
    let high = (((seen.max_px + RIM_PX) / STEP_PX).ceil() * STEP_PX).min(size_px);
    let part_px = high - low;
    part_px.cmpgt(DVec2::ZERO).all().then(|| Pinhole {
        width_px: part_px.x as u32,
        height_px: part_px.y as u32,
        centre_px: view.centre_px - low,
        ..*view
    })
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use glam::DVec3;

    use super::*;

    fn ball(centre: DVec3, half_m: f64) -> Bounds {
        Bounds { min: centre - half_m, max: centre + half_m }
    }

    #[test]
    fn a_part_shows_all_that_the_view_shows_of_a_box() {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (640, 360), 1.0, 0.1);
        let bounds = ball(DVec3::new(0.4, -0.2, 8.0), 0.3);
        let cut = part(&view, &bounds).expect("is seen");
        assert!(cut.width_px * cut.height_px < 640 * 360 / 20, "{}x{}", cut.width_px, cut.height_px);
        for corner in bounds.corners() {
            assert!(cut.contains(cut.image_from_world(corner).expect("before the eye")));
        }
        assert_eq!(part(&view, &ball(DVec3::new(90.0, 0.0, 8.0), 1.0)), None, "beside it");
        assert_eq!(part(&view, &ball(DVec3::new(0.0, 0.0, -8.0), 1.0)), None, "behind the eye");
        assert_eq!(part(&view, &ball(DVec3::ZERO, 5.0)), Some(view), "around the eye");
    }
}
