//! What lights see, for clients that draw shadows: surfaces that cast, wherever the eye is.
//!
//! Xie, Wang, Popescu 2016, section 5: a lamp (a light with an area) is served by a non-redundant set of images from points of it
//! ([`METHOD`]): there its four corners, here as many as are needed ([`places`]), chosen anew while things move. They hold what stands before any of its points, also what the eye never saw, and what is held for
//! them moves with its objects like all that is held. So a set is made once, and afterwards looked at only when the light or an object moved: the scene from a
//! corner, laid beside the same view of what the client holds of the set, by the very rules of the eye's samples ([`crate::account`]). The eye may go
//! anywhere meanwhile; no view of a lamp depends on it.
//!
//! Beyond the paper, lights without an area are served the same way, and lamps whose client draws hard shadows: from where their shadow maps are seen from
//! ([`protocol::shadow_views`]). The narrower frames of a light from afar go along with the eye; what comes into them is sent as finely as they see it.
//!
//! | what | what is sent |
//! |---|---|
//! | no light, or a client without shadows | nothing |
//! | a light before which nothing stands before anything else | a patch without samples, once: it casts nothing |
//! | a new light | a set: a lamp's one to eight images, or as many a face of a cube where it hangs amid things; a spot's one, a point's up to six, three frames of a light from afar |
//! | a light or an object that moved | what a view lacks, the views in turn; all of them where something deforms |
//! | an eye that left the middle of a frame | what the frame lacks where it is now |
//! | none of these | nothing, and nothing is drawn |
//!
//! The lights are those that clients draw: among those that bring the most to the eye. One that was served stays so while there is
//! a place for it, so that an eye between lights does not have them sent again and again.
//!
//! A surface of one side is seen from its front alone, as everywhere; from behind, light passes through it.
//!
//! **Whether anything casts** is asked of probes that are peeled (Everitt 2001): where a second layer is empty in every view, no surface
//! stands before another. What is narrower than a pixel of theirs may be missed. Insides of two-sided things count as a second layer.
//!
//! Samples have no colours here, nor what only reflections need. Their depths are kept to a tenth of the farthest footprint, so that
//! they stay within the half by which a caster must stand before what it shadows.

mod caster;
mod kept;
pub mod places;
mod serve;

pub use kept::Kept;
pub use serve::{METHOD, Serving, serve};
