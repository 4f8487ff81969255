//! Going to another view by itself: from where all is seen, from a side, to a place. A person who moves ends it.

use camera::Rigid;

/// Time constant of a flight, in seconds: most of the way is done in a third of one.
pub(super) const SMOOTHING_S: f64 = 0.12;
/// Part of the view's width or height that all of a scene fills, whichever is less.
pub(super) const FRAME_SHARE: f64 = 0.9;
/// Who goes to a place ends at this share of the distance to it.
pub(super) const NEARER: f64 = 0.35;

/// A view of all of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// From where the eye looks now.
    Same,
    /// Along -z.
    Front,
    /// Along -x.
    Right,
    /// Along -y, nearly.
    Top,
}

/// Where the eye goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flight {
    pub world_from_eye: Rigid,
    pub distance_m: f64,
}
