//! What of a client was looked ahead for.

use camera::{Pinhole, Rigid};

use crate::discretize::Capture;
use crate::viewer::Viewer;

/// A view that shows nothing new says little of the next one: what is expected falls by no more than this share from view to view.
const COST_KEPT: f64 = 0.7;
/// No part of a view is expected to cost less, in bytes a pixel: what may be sent is divided by it, so it must not be 0. Chosen: a fortieth of the 2 bytes that
/// are expected at first. With a tenth of it, a view that showed nothing new may have ten times as many pixels looked at in a turn.
const LEAST_BYTES_PER_PX: f64 = 0.05;

/// What of a client was looked ahead for.
#[derive(Debug, Clone, Default)]
pub struct Kept {
    /// Poses that were looked from, all of the view.
    pub(super) done: Vec<Rigid>,
    /// The pose that is being looked from, and the rows of it that were.
    pub(super) begun: Option<(Rigid, u32)>,
    /// The viewer's pose when nothing was left.
    pub(super) ended_at: Option<Rigid>,
    /// Expected bytes of a pixel; `None` before any.
    pub(super) bytes_per_px: Option<f64>,
}

impl Kept {
    /// Rows of a view were looked at.
    pub fn looked(&mut self, part: &Part) {
        let rows = part.first_row + part.camera.height_px;
        if rows < part.view.height_px {
            self.begun = Some((part.view.world_from_eye, rows));
        } else {
            self.begun = None;
            self.done.push(part.view.world_from_eye);
        }
    }

    /// An update was made of so many pixels.
    pub fn sent(&mut self, bytes: usize, pixels: u64) {
        let cost = (bytes as f64 / pixels.max(1) as f64).max(LEAST_BYTES_PER_PX);
        self.bytes_per_px = Some(self.bytes_per_px.map_or(cost, |old| cost.max(COST_KEPT * old)));
    }

    /// Nothing is left to look at for who stands there.
    pub fn ended(&mut self, viewer: &Viewer) {
        self.ended_at = Some(viewer.world_from_eye);
    }

    /// Something was evicted, and may be of use again.
    pub fn evicted(&mut self) {
        *self = Kept { bytes_per_px: self.bytes_per_px, ..Kept::default() };
    }
}

/// Rows of a view that are looked at together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// The whole view.
    pub view: Pinhole,
    /// These rows of it, from the same eye.
    pub camera: Pinhole,
    pub(super) first_row: u32,
}

impl Part {
    /// Its rows of a capture of the whole view.
    pub fn rows_of(&self, whole: Capture) -> Capture {
        if self.camera == self.view {
            return whole;
        }
        whole.cropped((0, self.first_row), (self.camera.width_px, self.camera.height_px))
    }
}
