//! What keeps surfaces from shadowing themselves.

use crate::draw::map_space::ROUNDING;

/// What keeps surfaces from shadowing themselves: see [`super`]; beside it casters stand back by half of their footprints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bias {
    /// So many times what slopes and rounding ask for: 1, but for showing what it is for.
    pub times: u32,
}

impl Default for Bias {
    fn default() -> Bias {
        Bias { times: 1 }
    }
}

impl Bias {
    /// How much of an inverse depth rounding may be.
    pub(super) fn rounding(self) -> f32 {
        (f64::from(self.times) * ROUNDING) as f32
    }

    /// Over how many texels what a plane rises hides nothing.
    pub(super) fn rise_texels(self) -> f32 {
        0.5 * self.times as f32
    }
}
