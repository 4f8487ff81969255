use thiserror::Error;

use crate::GraphError;

/// Images have no longer side than this, in pixels.
const MAX_SIDE_PX: u32 = 4096;

/// Nor more pixels: an update of 64 MiB then has 16 bytes for each, which is more than any sample was seen to take.
const MAX_PIXELS: u32 = 1 << 22;

/// Why what is written makes no camera. What concerns a frustum names it.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum WrittenError {
    /// Neither or several of the kinds of cameras.
    #[error("needs exactly one of graph_camera, single_pole, graph_description")]
    Kind,
    /// A side is 0 or too long.
    #[error("size_px {width_px} x {height_px}: a side may have 1 to {MAX_SIDE_PX} pixels, and all of it {MAX_PIXELS}")]
    Size {
        /// As written.
        width_px: u32,
        /// As written.
        height_px: u32,
    },
    /// A number is not finite or out of range.
    #[error("frustum {name:?}: {what} must be {needed}")]
    Number {
        /// Of which frustum.
        name: String,
        /// Its name.
        what: &'static str,
        /// What it may be.
        needed: &'static str,
    },
    /// Both or neither of two ways to say where it goes.
    #[error("frustum {name:?}: needs exactly one of {one} and {other}")]
    OneOf {
        /// Which frustum.
        name: String,
        /// One.
        one: &'static str,
        /// The other.
        other: &'static str,
    },
    /// More operations or frusta than a camera may have.
    #[error("frustum {name:?}: more than {most} {what}")]
    TooMany {
        /// The first one of the operation that is too much.
        name: String,
        /// Of what.
        what: &'static str,
        /// How many there may be.
        most: usize,
    },
    /// An operation on a frustum that no operation before it made.
    #[error("frustum {name:?}: there is no {of:?} before it")]
    Unknown {
        /// The frustum that the operation makes.
        name: String,
        /// The name without a frustum.
        of: String,
    },
    /// A frustum ends once.
    #[error("frustum {name:?}: {of:?} is bent, split or merged already")]
    EndsTwice {
        /// The frustum that the operation makes.
        name: String,
        /// The frustum that it would end.
        of: String,
    },
    /// The number of planes, or of frusta, does not fit the operation.
    #[error("frustum {name:?}: {needed}")]
    Planes {
        /// Which frustum.
        name: String,
        /// What is needed.
        needed: &'static str,
    },
    /// A plane that no ray of the frustum crosses.
    #[error("frustum {name:?}: its plane does not cut {of:?}")]
    NoFace {
        /// The frustum that would begin there.
        name: String,
        /// The frustum that would end there.
        of: String,
    },
    /// The frusta do not fit together.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// No object of the scene has the name.
    #[error("target: the scene has no object {name:?}")]
    NoTarget {
        /// As written.
        name: String,
    },
    /// The ring of a single-pole camera is not finite or negative.
    #[error("ring_m must be 0 or more")]
    Ring,
    /// The eye is inside of what it looks at, or what it looks at has no extent.
    #[error("eye: it must be outside of the ball around the target")]
    EyeInside,
}

/// Refuses what is too large for an image.
pub(super) fn check_size((width_px, height_px): (u32, u32)) -> Result<(), WrittenError> {
    let sides = 1..=MAX_SIDE_PX;
    let fits = sides.contains(&width_px) && sides.contains(&height_px) && width_px * height_px <= MAX_PIXELS;
    if fits { Ok(()) } else { Err(WrittenError::Size { width_px, height_px }) }
}
