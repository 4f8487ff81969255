//! Objects that are held as their triangles ([`protocol::Body`]), drawn as they are at the moment that is shown.
//!
//! A view gets them after its surfaces, into the same G-buffer, so they are lit, cast, reflect and hide as anything else. Bones are posed once a frame by the clip that
//! was sent, on the CPU: a figure has some twenty. Vertices are bent by the vertex stage, so that nothing but a uniform buffer is needed and WebGL2 draws
//! them, too. What shows less than a pixel, or lies beside the view, is left out.

mod instances;
mod pass;
mod placed;
mod store;

pub(crate) use instances::BodyInputs;
pub(crate) use pass::BodyPass;
pub use store::Bodies;
pub(crate) use store::bounds_world;
