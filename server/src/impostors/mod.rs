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
//! | all else around a reflector | images by graph cameras where corridors are known or found on the floor, else six by pinholes |
//! | what a flat mirror shows | five images from the eye's mirror image, see `planar.rs` |
//! | mirrors within the ball around a larger one | the images of that one, see `group.rs` |
//! | the inside of a glass object | an image of its back faces |
//! | many objects of a shape | one image for all, see [`relief`] |
//!
//! The papers walk the map of a maze that its maker gives; where a scene brings none, it is found by [`scene::floor_plan`], once, around
//! the reflector that is served first. Graph images hold what lies round corners, which no six images of one place do. They are no
//! better where a mirror stands in the middle of what it shows: in the report's maze (256 x 256, 12 poses) their mean error is 0.027 for
//! 163 kB, that of six images 0.023 for 53 kB, of an environment map 0.036.

mod decide;
pub mod draw;
mod group;
mod kept;
mod planar;
pub mod relief;

pub use crate::render::Faces;
pub use decide::{Basis, Decision, Drawn, Key, Needs, Shot, Wanted};
pub use kept::Kept;
