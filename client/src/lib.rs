//! The thin client, native and in the browser.
//!
//! - [`viewer`]: everything between the socket and the picture, without either.
//! - [`picture`]: the picture of what is held. [`frame`]: how one frame is drawn.
//! - [`impostors`]: images that rays are intersected with. [`reflect`]: mirrors and glass by them. [`relief`]: objects by them.
//! - [`occlusion`]: how much ambient light arrives. [`shadow`]: which lights do, softly by [`soft`];
//!   [`light_images`]: what casts soft shadows.
//! - [`rest`]: what a viewer who stands still sees, pixel by pixel.
//! - [`controls`]: where the eye goes, from mouse, keyboard and touch.
//! - [`connection`]: when to connect, when to try again, and what to tell the person meanwhile.
//! - [`panel`]: the figures that the panel shows.
//! - [`address`]: a server's address as people type it.
//! - Natively: `socket`, the websocket, and `pump`, its loop; `traffic`, what crosses it; `window`, the viewer's window;
//!   `headless`, the viewer along a camera trace.

pub mod address;
pub mod connection;
pub mod controls;
mod coverage;
mod fill;
pub mod frame;
mod fullscreen;
#[cfg(not(target_arch = "wasm32"))]
pub mod headless;
mod held_pass;
pub mod impostors;
mod light;
pub mod light_images;
pub mod occlusion;
pub mod panel;
mod parts;
pub mod picture;
#[cfg(not(target_arch = "wasm32"))]
pub mod pump;
pub mod reflect;
pub mod relief;
pub mod rest;
pub mod shadow;
#[cfg(not(target_arch = "wasm32"))]
pub mod socket;
pub mod soft;
#[cfg(not(target_arch = "wasm32"))]
pub mod traffic;
pub mod viewer;
#[cfg(not(target_arch = "wasm32"))]
pub mod window;
