//! Pictures of a few pixels, drawn of all that is held beside the screen's, and read back.

use camera::Pinhole;
use gpu::{Gpu, Pending, Readback, Slot};
use surface::{GBuffer, Smoothing};

use crate::draw::held_pass::HeldPass;
use crate::draw::shown::Shown;

/// One picture at a time, all of one size.
#[derive(Debug, Default)]
pub(crate) struct Peek {
    target: Option<GBuffer>,
    asked: Option<Asked>,
}

#[derive(Debug)]
struct Asked {
    camera: Pinhole,
    pending: Pending,
    w: Slot,
    normal_ids: Slot,
}

/// What a camera saw, by pixel, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    pub camera: Pinhole,
    /// Inverse depth; 0 where there is nothing.
    pub w: Vec<f32>,
    /// See [`GBuffer::normal_ids`].
    pub normal_ids: Vec<[u32; 2]>,
}

impl Peek {
    /// Asks what a camera sees. What was asked before is forgotten.
    pub fn ask(&mut self, gpu: &Gpu, held: &mut HeldPass, shown: Shown<'_>, camera: &Pinhole) {
        let size_px = (camera.width_px, camera.height_px);
        let target = self.target.take().filter(|target| target.size_px == size_px);
        let target = self.target.insert(target.unwrap_or_else(|| GBuffer::new(gpu, size_px)));
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        held.encode(&mut encoder, shown, camera, Smoothing::default(), target);
        let mut readback = Readback::default();
        let w = readback.texture(&target.w, 0, target.size_px);
        let normal_ids = readback.texture(&target.normal_ids, 0, target.size_px);
        let encoded = readback.encode(gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        self.asked = Some(Asked { camera: *camera, pending: encoded.map(), w, normal_ids });
    }

    /// Whether an answer is still to come.
    pub fn is_asked(&self) -> bool {
        self.asked.is_some()
    }

    /// What was seen, once: `Some(None)` of a device that was lost. `None` as long as it is not known.
    pub fn take(&mut self) -> Option<Option<Seen>> {
        if !self.asked.as_ref()?.pending.is_ready() {
            return None;
        }
        let Asked { camera, pending, w, normal_ids } = self.asked.take()?;
        let Ok(mapped) = pending.take() else { return Some(None) };
        Some(Some(Seen { camera, w: mapped.values(w), normal_ids: mapped.values(normal_ids) }))
    }
}
