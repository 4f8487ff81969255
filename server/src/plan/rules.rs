//! What holds for all viewers of a scene.

/// A walker's margin: the region in which a standing person moves the head.
const WALK_MARGIN_M: f64 = 0.25;
/// An object's margin as a share of its bounding radius.
const OBJECT_MARGIN: f64 = 0.05;
/// A region of more than these many margins cannot be covered by a handful of images; faster viewers see holes.
const MAX_RADIUS_MARGINS: f64 = 8.0;
/// How much wider than the view an image is on each side, for turns that nobody predicted.
pub(super) const TURN_MARGIN_RAD: f64 = 0.10;

/// What holds for all viewers of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Views of a plan at most.
    pub images: usize,
    /// An image has as many pixels as a square of this side.
    pub image_size_px: u32,
    /// Seconds between two ticks of a session.
    pub update_interval_s: f64,
    /// Points nearer than this have no image.
    pub near_m: f64,
    /// Radius of the region of a viewer who stands still.
    pub margin_m: f64,
    /// Whether the scene changes with time.
    pub animated: bool,
    /// Whether a viewer who stands still in what stands still is sent his own view, see [`crate::rest`].
    pub rests: bool,
    /// Whether what a viewer will need next is sent while nobody needs anything, see [`crate::anticipate`].
    pub anticipates: bool,
    /// How far a sample may be shifted on the screen by the coding of its depth.
    pub parallax_error_px: f64,
}

impl Rules {
    /// The margin of a scene with this bounding radius.
    pub fn margin_m(walk: bool, bounds_radius_m: f64) -> f64 {
        let object_m = OBJECT_MARGIN * bounds_radius_m;
        let margin_m = if walk { WALK_MARGIN_M.min(object_m) } else { object_m };
        if margin_m > 0.0 { margin_m } else { WALK_MARGIN_M }
    }

    pub(super) fn max_radius_m(&self) -> f64 {
        self.margin_m * MAX_RADIUS_MARGINS
    }
}
