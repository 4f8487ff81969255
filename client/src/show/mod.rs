//! Where pictures are shown, and who looks at them.
//!
//! - [`controls`]: where the eye goes, from mouse, keyboard and touch.
//! - [`panel`]: how the panel writes figures.
//! - Natively: `window`, the viewer's window; `headless`, the viewer along a camera trace.

pub mod begin;
pub mod controls;
#[cfg(not(target_arch = "wasm32"))]
pub mod headless;
pub mod panel;
#[cfg(not(target_arch = "wasm32"))]
pub mod window;
