//! Impostors: images of what reflectors show, which a client intersects rays with. What a scene needs of them, and what a client
//! was sent.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, sections 3 to 5. The papers choose by
//! hand; here the server decides for each reflector ([`Needs::decide`]) and says why; [`draw`] makes the images:
//!
//! | what | impostor |
//! |---|---|
//! | no mirror and no glass in reach of the viewer | none |
//! | all that is around a reflector | six images by pinholes; along corridors by graph cameras that bend as far as the reflector sees round corners, where probes say so |
//! | an object that hides much from a reflector, or of which it sees much | an image of its own: by a pinhole, or by a single-pole occlusion camera |
//! | what a flat mirror shows | five images from the eye's mirror image, see `planar.rs` |
//! | mirrors within the ball around a larger one | the images of that one, see `group.rs` |
//! | the inside of a glass object | an image of its back faces |
//! | many objects of a shape | one image for all, see [`relief`] |
//!
//! Which of these, probes say ([`Needs::choose`], `choose.rs`): every candidate's images are drawn and held against rays whose answers are known, and
//! the one with the least error at equal bytes is sent. In the report's maze (256 x 256, 4 poses) that is six images and one of the stand below the
//! mirror: a mean error of 0.017 for 56 kB, where by the rule that all near things get images past their silhouettes it was 0.024 for 161 kB, and those took
//! five seconds to draw instead of a tenth.

mod choice;
mod choices;
mod choose;
mod decide;
pub mod draw;
mod group;
mod kept;
mod planar;
mod plans;
mod probes;
mod reflector;
pub mod relief;
mod wanted;

pub use crate::render::Faces;
pub use choice::{Choice, OwnImage, Rule};
pub use choices::Choices;
pub use decide::Needs;
pub use kept::Kept;
pub use wanted::{Basis, Decision, Drawn, Key, Shot, Wanted};
