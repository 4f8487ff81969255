//! What lies at a place of the picture: a few pixels around it are drawn of all that is held, and read back.

use camera::{ImagePoint, Pinhole};
use glam::{DVec2, DVec3};
use gpu::{Gpu, Pending, Readback, Slot};
use surface::{GBuffer, Smoothing};

use crate::draw::held_pass::HeldPass;
use crate::draw::shown::Shown;

/// Pixels a side. Where there is nothing at the place itself, what is nearest to it in the picture counts: fingers are broad.
const SIDE_PX: u32 = 15;

/// At most one at a time.
#[derive(Debug, Default)]
pub(crate) struct Pick {
    target: Option<GBuffer>,
    asked: Option<Asked>,
}

#[derive(Debug)]
struct Asked {
    camera: Pinhole,
    pending: Pending,
    w: Slot,
}

/// The pixels of a camera around a place.
fn around(camera: &Pinhole, at_px: DVec2) -> Pinhole {
    let corner_px = at_px - f64::from(SIDE_PX) / 2.0;
    Pinhole { width_px: SIDE_PX, height_px: SIDE_PX, centre_px: camera.centre_px - corner_px, ..*camera }
}

impl Pick {
    /// Asks what a camera sees at a place of its picture. What was asked before is forgotten.
    pub fn ask(&mut self, gpu: &Gpu, held: &mut HeldPass, shown: Shown<'_>, camera: &Pinhole, at_px: DVec2) {
        let camera = around(camera, at_px);
        let target = self.target.get_or_insert_with(|| GBuffer::new(gpu, (SIDE_PX, SIDE_PX)));
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        held.encode(&mut encoder, shown, &camera, Smoothing::default(), target);
        let mut readback = Readback::default();
        let w = readback.texture(&target.w, 0, target.size_px);
        let encoded = readback.encode(gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        self.asked = Some(Asked { camera, pending: encoded.map(), w });
    }

    /// The point that was found, in world space, once: `Some(None)` where nothing is there. `None` as long as it is not known.
    pub fn take(&mut self) -> Option<Option<DVec3>> {
        if !self.asked.as_ref()?.pending.is_ready() {
            return None;
        }
        let Asked { camera, pending, w } = self.asked.take()?;
        // Of a device that was lost nothing comes back.
        let Ok(mapped) = pending.take() else { return Some(None) };
        Some(nearest(&camera, &mapped.values(w)))
    }
}

/// The surface nearest to the middle of the picture, in pixels.
fn nearest(camera: &Pinhole, w: &[f32]) -> Option<DVec3> {
    let place = |index: usize| DVec2::new((index as u32 % SIDE_PX) as f64 + 0.5, (index as u32 / SIDE_PX) as f64 + 0.5);
    let middle = DVec2::splat(f64::from(SIDE_PX) / 2.0);
    let off = |index: &usize| place(*index).distance_squared(middle);
    let there = (0..w.len()).filter(|&index| w[index] > 0.0);
    let index = there.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let at = place(index);
    let point = ImagePoint { u: at.x, v: at.y, w: f64::from(w[index]) };
    Some(camera.world_from_image(point))
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
        let mut w = vec![0.0; count];
        assert_eq!(nearest(&camera, &w), None);
        (w[3], w[count / 2 + 1]) = (0.5, 0.25);
        let point_world = nearest(&camera, &w).expect("something is there");
        let back = whole.image_from_world(point_world).expect("before the eye");
        assert!((back.u - 501.0).abs() < 1e-6 && (back.v - 30.0).abs() < 1e-6 && (back.w - 0.25).abs() < 1e-9);
    }
}
