//! From what is held to the picture. Each effect is a pass with plain inputs; [`frame`] alone knows them all.
//!
//! - [`picture`]: the picture of what is held. [`frame`]: how one frame is drawn. [`shown`]: what it shows.
//! - [`impostors`]: images that rays are intersected with. [`reflect`]: mirrors and glass by them. [`relief`]: objects by them.
//! - [`bodies`]: objects as their triangles.
//! - [`occlusion`]: how much ambient light arrives. [`shadow`]: which lights do, softly by [`soft`];
//!   [`light_images`]: what casts soft shadows.
//! - [`effects`]: which of both are drawn, by how long frames take.
//! - [`pick`]: what lies at a place of the picture. [`feel`]: what stops who walks.
//! - [`antialiasing`]: whether outlines are smooth while the view changes.
//! - [`steady`]: how frames come in time where a device is too slow to draw all that is held for each.
//! - [`camera_image`]: the image of a camera that was asked for by its name, in place of all else.
//! - [`layers`]: what the eye sees through, blended with what lies behind it.
//! - [`rest`]: what a viewer who stands still sees, pixel by pixel.

pub mod antialiasing;
pub mod bodies;
pub mod camera_image;
mod coverage;
mod device_times;
pub mod effects;
pub mod feel;
mod fill;
pub mod frame;
mod fullscreen;
mod held_pass;
pub mod impostors;
pub mod layers;
mod light;
pub mod light_images;
mod lit;
mod map_space;
pub mod occlusion;
mod parts;
mod peek;
pub mod pick;
pub mod picture;
mod planes;
pub mod reflect;
pub mod relief;
pub mod rest;
pub mod shadow;
mod shares;
pub mod shown;
pub mod soft;
pub mod steady;
mod through;
