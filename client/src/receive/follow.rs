//! What follows the held copy.

use protocol::{Held, Update};

/// What follows the held copy, such as surfaces on a GPU.
pub trait Follow {
    /// `held` has just applied `update`; `anew` where nothing of what was held before is left.
    fn follow(&mut self, held: &Held, update: &Update, anew: bool);

    /// Whether it may change now; until then updates wait.
    fn is_ready(&self) -> bool {
        true
    }
}

/// Follows nothing.
impl Follow for () {
    fn follow(&mut self, _: &Held, _: &Update, _: bool) {}
}
