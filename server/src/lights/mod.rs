//! What lights with an area (lamps) see, for clients that draw soft shadows: surfaces that cast, wherever the eye is.
//!
//! Xie, Wang, Popescu 2016, section 5: a lamp is served by a non-redundant set of the images from its four corners ([`crate::discretize::Discretization::COVERED`]). They hold what
//! stands before any of its points, also what the eye never saw, and what is held for them moves with its objects like all that is
//! held. So a set is made once, and afterwards looked at only when the lamp or an object moved: the scene from a corner, laid beside
//! the same view of what the client holds of the set, by the very rules of the eye's samples ([`crate::account`]). The eye may go
//! anywhere meanwhile; no view of a lamp depends on it.
//!
//! | what | what is sent |
//! |---|---|
//! | no lamp, or a client without soft shadows | nothing |
//! | a lamp before which nothing stands before anything else | a patch without samples, once: it casts nothing |
//! | a new lamp | a set: four images, or four a face of a cube where it hangs amid things |
//! | a lamp or an object that moved | what a corner lacks, the corners in turn; all of them where something deforms |
//! | neither | nothing, and nothing is drawn |
//!
//! The lamps are those that clients draw: among the lights that bring the most to the eye. One that was served stays so while there is
//! a place for it, so that an eye between lamps does not have them sent again and again.
//!
//! **Whether anything casts** is asked of probes that are peeled (Everitt 2001): where a second layer from a corner is empty, no surface
//! stands before another. What is narrower than a pixel of theirs may be missed. Insides of two-sided things count as a second layer.
//!
//! Samples have no colours here, nor what only reflections need. Their depths are kept to a tenth of the farthest footprint, so that
//! they stay within the half by which a caster must stand before what it shadows.

mod caster;
mod kept;
mod serve;

pub use kept::Kept;
pub use serve::{Serving, serve};
