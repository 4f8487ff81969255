//! What is known of held samples beside what a view shows of them.

use camera::Pinhole;
use glam::DVec3;
use protocol::{PatchId, Purpose};

/// The address of a held sample: patch, x, y.
pub type Address = (PatchId, u16, u16);

/// How a held sample was captured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Captured {
    /// The triangle; 0 for an unknown address.
    pub triangle: u32,
    /// Step of its coded inverse depth, 1/m.
    pub w_step: f32,
    /// Samples an area, in 1/m²: see [`density`]; infinite for an unknown address.
    pub density: f32,
}

impl Captured {
    /// Of an unknown address.
    pub const UNKNOWN: Captured = Captured { triangle: 0, w_step: 0.0, density: f32::INFINITY };
}

/// What is known of held samples beside what a view shows of them.
pub trait Samples: Sync {
    /// How a sample was captured.
    fn captured(&self, address: Address) -> Captured;
    /// Where its centre is now, in world space, if it is of `object`.
    fn centre_world(&self, address: Address, object: u16) -> Option<DVec3>;
    /// By pixel of a view: the triangle of the sample that is held for a purpose from this very camera, and was not carried elsewhere since;
    /// 0 where there is none.
    fn sent_by(&self, camera: &Pinhole, purpose: Purpose) -> Vec<u32>;
}

/// Samples an area: `f² |n.r| w²`, with the ray `r = (x', y', 1)`, from the area `z² / (f² |n.r|)` that a pixel covers.
pub fn density(focal_px: f32, w: f32, facing: f32) -> f32 {
    focal_px * focal_px * facing.abs() * w * w
}
