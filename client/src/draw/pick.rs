//! What lies at a place of the picture: a few pixels around it are drawn of all that is held.

use camera::{ImagePoint, Pinhole};
use glam::{DVec2, DVec3};
use gpu::Gpu;

use crate::draw::held_pass::HeldPass;
use crate::draw::peek::{Peek, Seen};
use crate::draw::shown::Shown;

/// Pixels a side. Where there is nothing at the place itself, what is nearest to it in the picture counts: fingers are broad.
const SIDE_PX: u32 = 15;

/// At most one at a time.
#[derive(Debug, Default)]
pub(crate) struct Pick(Peek);

/// What lies at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picked {
    /// In world space.
    pub at_world: DVec3,
    /// Of which object.
    pub object: u16,
}

/// The pixels of a camera around a place.
fn around(camera: &Pinhole, at_px: DVec2) -> Pinhole {
    let corner_px = at_px - f64::from(SIDE_PX) / 2.0;
    Pinhole { width_px: SIDE_PX, height_px: SIDE_PX, centre_px: camera.centre_px - corner_px, ..*camera }
}

impl Pick {
    /// Asks what a camera sees at a place of its picture. What was asked before is forgotten.
    pub fn ask(&mut self, gpu: &Gpu, held: &mut HeldPass, shown: Shown<'_>, camera: &Pinhole, at_px: DVec2) {
        self.0.ask(gpu, held, shown, &around(camera, at_px));
    }

    /// What was found, once: `Some(None)` where nothing is there. `None` as long as it is not known.
    pub fn take(&mut self) -> Option<Option<Picked>> {
        Some(self.0.take()?.and_then(|seen| nearest(&seen)))
    }
}

/// The surface nearest to the middle of the picture, in pixels.
fn nearest(Seen { camera, w, normal_ids }: &Seen) -> Option<Picked> {
    let place = |index: usize| DVec2::new((index as u32 % SIDE_PX) as f64 + 0.5, (index as u32 / SIDE_PX) as f64 + 0.5);
    let middle = DVec2::splat(f64::from(SIDE_PX) / 2.0);
    let off = |index: &usize| place(*index).distance_squared(middle);
    let there = (0..w.len()).filter(|&index| w[index] > 0.0);
    let index = there.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let at = place(index);
    let point = ImagePoint { u: at.x, v: at.y, w: f64::from(w[index]) };
    // Of a surface's ids the lower half is its object.
    Some(Picked { at_world: camera.world_from_image(point), object: normal_ids[index][1] as u16 })
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    #[test]
    fn what_is_nearest_to_the_place_counts() {
        let start = Rigid::look_at(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO);
        let whole = Pinhole::symmetric(start, (640, 400), 1.0, 0.1);
        let camera = around(&whole, DVec2::new(500.0, 30.0));
        let count = (SIDE_PX * SIDE_PX) as usize;
        let mut seen = Seen { camera, w: vec![0.0; count], normal_ids: vec![[0; 2]; count] };
        assert_eq!(nearest(&seen), None);
        (seen.w[3], seen.w[count / 2 + 1]) = (0.5, 0.25);
        seen.normal_ids[count / 2 + 1] = [7, 0x8002_0007];
        let Picked { at_world, object } = nearest(&seen).expect("something is there");
        assert_eq!(object, 7, "beside its material");
        let back = whole.image_from_world(at_world).expect("before the eye");
        assert!((back.u - 501.0).abs() < 1e-6 && (back.v - 30.0).abs() < 1e-6 && (back.w - 0.25).abs() < 1e-9);
    }
}
