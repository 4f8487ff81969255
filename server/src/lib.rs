//! The server: plan -> discretize -> encode -> socket.
//!
//! - [`render`]: the scene on the GPU; [`discretize`]: depth images of it; [`truth`]: the picture that a reconstruction is
//!   compared with; [`look`]: its lights as both ends shade with them.

pub mod discretize;
pub mod look;
pub mod render;
mod targets;
pub mod truth;
