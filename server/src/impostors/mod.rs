//! Impostors: images of what reflectors show, which a client intersects rays with. What a scene needs of them, and what a client
//! was sent.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, sections 3 to 5. The papers choose by
//! hand; here the server decides for each reflector ([`Needs::decide`]) and says why; [`draw`] makes the images:
//!
//! | what | impostor |
//! |---|---|
//! | no mirror and no glass in reach of the viewer | none |
//! | a flat object near a reflector | an image by a pinhole: a billboard |
//! | another object near a reflector | an image by a single-pole occlusion camera |
//! | all else around a reflector | an image by graph cameras where corridors are known, else six by pinholes |
//! | the inside of a glass object | an image of its back faces |
//! | many objects of a shape | one image for all, see [`relief`] |

mod decide;
pub mod draw;
mod kept;
pub mod relief;

pub use crate::render::Faces;
pub use decide::{Basis, Decision, Drawn, Key, Needs, Shot, Wanted};
pub use kept::Kept;
