//! The thin client, native and in the browser.
//!
//! - [`controls`]: where the eye goes, from mouse, keyboard and touch.
//! - [`connection`]: when to connect, when to try again, and what to tell the person meanwhile.
//! - [`panel`]: the figures that the panel shows.

pub mod connection;
pub mod controls;
pub mod panel;
