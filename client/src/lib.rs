//! The thin client, native and in the browser.
//!
//! - [`frame`]: from what is held to the picture: surface, `light`, `fill`, present, `coverage`.
//! - [`viewer`]: everything between the socket and the picture, without either.
//! - [`controls`]: where the eye goes, from mouse, keyboard and touch.
//! - [`connection`]: when to connect, when to try again, and what to tell the person meanwhile.
//! - [`panel`]: the figures that the panel shows.
//! - [`address`]: a server's address as people type it.
//! - Natively, `socket`: the websocket.

pub mod address;
pub mod connection;
pub mod controls;
mod coverage;
mod fill;
pub mod frame;
mod fullscreen;
mod light;
pub mod panel;
#[cfg(not(target_arch = "wasm32"))]
pub mod socket;
pub mod viewer;
