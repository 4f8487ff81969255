//! Which images serve a reflector: plain values.

use std::sync::Arc;

use camera::CorridorMap;

/// How an object near a reflector is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OwnImage {
    /// By an image of its own from the reflector's middle; a billboard where it is flat.
    Plain,
    /// By one that sees past its silhouette.
    PastSilhouette,
}

/// What serves a reflector for which nothing was tried.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Rule {
    /// Six images around it.
    Around,
    /// Six that bend round the corners of corridors; of a flat mirror those from the eye's mirror image.
    Bent,
    /// Plain images of what seems large from it, and six of all else.
    Plain,
    /// Images past the silhouette of what seems large, and six of all else that bend; of a flat mirror those from the eye's mirror image.
    #[default]
    Finest,
}

/// Which images serve a reflector.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Objects with images of their own; all others are in the surroundings.
    pub own: Vec<(u16, OwnImage)>,
    /// Whether the surroundings of a flat mirror are seen from the eye's mirror image.
    pub from_mirrored_eye: bool,
    /// What views along corridors bend by; `None` where all go straight.
    pub corridors: Option<Arc<CorridorMap>>,
    /// What was found out about the images, for people; empty where the choice is by rule.
    pub found: String,
}
