//! The thin client, native and in the browser. Data go one way through its floors:
//!
//! - [`receive`]: from the socket to what is held;
//! - [`draw`]: from what is held to the picture;
//! - [`show`]: a window, a headless run, and the controls.

pub mod draw;
pub mod receive;
pub mod show;
