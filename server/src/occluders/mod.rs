//! What keeps ambient light off what the eye sees, for clients that draw ambient occlusion: surfaces that the eye itself never saw.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.3: "some output image pixels are
//! occluded by geometry that is not visible from the current viewpoint", so their z-buffer is that of a camera that sees more. There the
//! scene is at hand. A client of ours holds what its eye saw; what else its cameras would see must be sent.
//!
//! Four views stand around what is looked at ([`protocol::Ball`], which both ends share): around everything where the eye is outside of it,
//! else around the eye, in coarse steps. Each is peeled (three layers deep; Everitt 2001), and of what it shows is sent
//!
//! - what may occlude: what lies within reach of another surface, and above its tangent plane;
//! - and is not held, neither for the eye nor as an occluder.
//!
//! | what | what is sent |
//! |---|---|
//! | a client that draws no occlusion, or by its own view only | nothing |
//! | nothing within reach above anything, as in the open | nothing |
//! | a new client | what all four views lack |
//! | an eye that left the middle of its ball, or an object that moved | what a view lacks, the views in turn |
//! | none of these | nothing, and nothing is drawn |
//!
//! What is held moves with its objects; what deforms away is deleted. Where it takes more than its share of the client's memory, all of
//! it is sent anew. What reliefs show to the eye is not held for it as surfaces, and so is among what is sent.

mod kept;
mod near;
mod serve;

pub use kept::Kept;
pub use serve::{Serving, serve};
