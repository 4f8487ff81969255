//! What a client was sent of its view at rest.

use camera::Pinhole;
use protocol::held::PatchId;

/// Rows of a view that are to be sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// The whole view.
    pub view: Pinhole,
    /// These rows of it, from the same eye.
    pub camera: Pinhole,
}

/// See the module.
#[derive(Debug, Default)]
pub struct Kept {
    pub(super) camera: Option<Pinhole>,
    pub(super) rows: u32,
    /// What the rows cost.
    bytes: usize,
    patches: Vec<PatchId>,
}

impl Kept {
    /// Rows were sent, in one patch or several.
    pub fn sent(&mut self, strip: &Strip, patches: &[PatchId]) {
        self.camera = Some(strip.view);
        self.rows += strip.camera.height_px;
        self.patches.extend(patches);
    }

    /// The patches of its rows.
    pub fn patches(&self) -> &[PatchId] {
        &self.patches
    }

    /// What the rows that were [`Kept::sent`] last came to.
    pub fn coded(&mut self, bytes: usize) {
        self.bytes += bytes;
    }

    /// What a pixel cost so far; `None` before any.
    pub(super) fn bytes_per_px(&self) -> Option<f64> {
        let pixels = self.camera?.width_px * self.rows;
        Some(self.bytes as f64 / f64::from(pixels))
    }

    /// Forgets the rows of any other view than `view`, and says which patches they were.
    pub fn drop_others(&mut self, view: Option<&Pinhole>) -> Vec<PatchId> {
        if self.camera.as_ref() == view { Vec::new() } else { std::mem::take(self).patches }
    }
}
