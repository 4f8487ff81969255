//! The GPU as both ends see it: the device, reading back from it, and the uniform structs that shaders of both ends share.
//!
//! - [`Gpu`]: an adapter and its device, with what it can do ([`Caps`]).
//! - [`readback`]: textures and buffers copied to the CPU without stalling.
//! - [`uniforms`]: the Rust twins of the shared WGSL structs.
//!
//! Natively, set `XDG_RUNTIME_DIR` to quiet the warnings of EGL.

mod device;
pub mod readback;
mod sky;
pub mod uniforms;

pub use device::{Caps, Gpu, GpuError};
pub use readback::{Mapped, Pending, Readback, ReadbackError, Slot};
pub use sky::SkyTexture;
pub use uniforms::{LightUniform, LightingUniform, MaterialUniform, PinholeUniform, columns};
