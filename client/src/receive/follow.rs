//! What follows the held copy.

use protocol::{Held, Update};
use surface::BuiltSurfaces;

/// What follows the held copy, such as surfaces on a GPU.
pub trait Follow {
    /// `held` has just applied `update`; `anew` where nothing of what was held before is left. Surfaces that were `built` of its patches need not be built again.
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces);

    /// Uploads a piece of surfaces that were built of an update's patches, before it is applied; whether all pieces are there.
    fn upload(&mut self, _: &mut BuiltSurfaces) -> bool {
        true
    }

    /// Whether it may change now; until then updates wait.
    fn is_ready(&self) -> bool {
        true
    }
}

/// Follows nothing.
impl Follow for () {
    fn follow(&mut self, _: &Held, _: &Update, _: bool, _: &mut BuiltSurfaces) {}
}
