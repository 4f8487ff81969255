//! What a client holds, drawn as surfaces: the hybrid reconstruction of Xie, Wang, Popescu 2016, §4, Alg. 4.
//!
//! Every sample of a depth image becomes one quad over its pixel. [`corners`] decides where its four corners lie, [`mesh`]
//! puts the quads of one patch together so that neighbours on one surface share vertices (watertight, no overdraw),
//! [`Built`] is what comes out, [`HeldSurfaces`] keeps one a patch on the GPU, and [`SurfacePass`] draws them into a [`GBuffer`]; [`AddressPass`] draws which sample is
//! seen where, for the server. There is no
//! compute stage and no storage buffer, so the same code runs on WebGPU and WebGL2.
//!
//! Spaces: a vertex is `(u, v, w)` of its patch's image; the vertex stage takes it to the *output eye* by a matrix that is
//! composed in f64 for each patch (and each moving object in it), so a scene far from the origin loses nothing.

// Waits for the GPU or uses threads, which a browser must not; only servers ask.
#[cfg(not(target_arch = "wasm32"))]
mod address;
mod built;
pub mod corners;
mod gbuffer;
mod held;
mod levels;
pub mod mesh;
mod parallelograms;
mod pass;
mod patch;
mod placement;
mod points;
mod redraw;
mod slices;
pub mod tiles;
mod tint;

#[cfg(not(target_arch = "wasm32"))]
pub use address::{AddressPass, AddressTexel, AddressView};
pub use built::{Build, Built, BuiltSurfaces, DamagedSurface, FarBytes};
pub use corners::{CornerRules, Corners};
pub use gbuffer::GBuffer;
pub use held::HeldSurfaces;
pub use mesh::{PatchMesh, ProvokingVertex, Vertex};
pub use parallelograms::{FlattenPass, INVOCATIONS_A_ROW, Parallelograms, dispatch};
pub use pass::{CastPass, SETBACK_FOOTPRINTS, Smoothing, SurfacePass};
pub use patch::SurfaceStats;
pub use points::{FRUSTUM_PLANES, PointBuffer, PointPass, Projection};
pub use slices::Slices;
pub use tint::Tint;

/// Why surfaces could not be built or drawn.
#[derive(Debug, thiserror::Error)]
pub enum SurfaceError {
    /// The GPU refused.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A shader could not be put together: a mistake in the program.
    #[error(transparent)]
    Shader(#[from] shaders::ShaderError),
}
