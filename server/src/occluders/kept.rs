use std::collections::VecDeque;
use std::sync::Arc;

use camera::Bounds;
use protocol::Ball;
use scene::{Scene, Snapshot};

use crate::whereabouts;

/// What a client was sent of occluders.
#[derive(Debug, Clone, Default)]
pub struct Kept {
    /// What was looked at last, and how far occluders reached.
    pub(super) around: Option<(Ball, f64)>,
    /// The views of it that something may lack, the next first.
    pub(super) due: VecDeque<usize>,
    /// The scene as it was looked at last, and a box around it.
    pub(super) scene: Option<(Arc<Snapshot>, Bounds)>,
}

impl Kept {
    /// A box around the scene as it is now, and whether anything moved since this was last asked.
    pub(super) fn bounds(&mut self, scene: &Scene, snapshot: &Arc<Snapshot>) -> (Bounds, bool) {
        let known = self.scene.take().filter(|(before, _)| !whereabouts::is_moved(scene, before, snapshot));
        let moved = known.is_none();
        let all = known.map_or_else(|| whereabouts::bounds(scene, snapshot), |(_, all)| all);
        self.scene = Some((snapshot.clone(), all));
        (all, moved)
    }
}
