//! Where pictures are shown, and who looks at them.
//!
//! - [`controls`]: where the eye goes, from mouse, keyboard and touch; [`headset`]: where the eyes of a headset are.
//! - [`panel`]: how the panel writes figures; [`begin`]: where an address says that one begins; [`tiles`]: pictures larger than what is drawn at once;
//!   [`tape`]: distances between points of a picture; [`staging`]: what of a scene, and when, an address asks for; [`quality`]: what a person chooses between.
//! - Natively: `window`, the viewer's window; `headless`, the viewer along a camera trace.

pub mod begin;
pub mod controls;
#[cfg(not(target_arch = "wasm32"))]
pub mod headless;
pub mod headset;
pub mod panel;
pub mod quality;
pub mod staging;
pub mod tape;
pub mod tiles;
#[cfg(not(target_arch = "wasm32"))]
pub mod window;
