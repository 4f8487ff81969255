//! What a window is told, and why one ends with an error.

use std::path::PathBuf;

use gpu::GpuError;
use network::Link;
use protocol::message::Role;
use thiserror::Error;

use crate::draw::picture::{PictureError, PictureOptions};
use crate::receive::address::AddressError;
use crate::receive::trust::TrustError;

/// What a window is told.
#[derive(Debug, Clone)]
pub struct Options {
    /// The server, as people type it.
    pub server: String,
    /// PEM file of certificates to trust beside those that are trusted anyway, for servers over TLS.
    pub tls_ca: Option<PathBuf>,
    /// First size of the window's inside, in physical pixels.
    pub size_px: (u32, u32),
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// What the held copy may take of this machine's memory.
    pub budget_bytes: u64,
    /// What the viewer is there for.
    pub role: Role,
    /// Graphics interface.
    pub renderer: Renderer,
    /// How pictures are drawn.
    pub picture: PictureOptions,
    /// The emulated network.
    pub link: Option<Link>,
}

/// A graphics interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Renderer {
    /// The best there is.
    Auto,
    /// Vulkan.
    Vulkan,
    /// Metal.
    Metal,
    /// Direct3D 12.
    Dx12,
    /// OpenGL.
    Gl,
}

/// Why a window ended with an error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WindowError {
    /// The address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The certificates to trust.
    #[error(transparent)]
    Trust(#[from] TrustError),
    /// No GPU, or it went away.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Drawing.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The window system.
    #[error("no window: {0} (without a display use --headless)")]
    Window(String),
    /// A surface that pictures can be shown on.
    #[error("the window cannot be drawn to: {0}")]
    Surface(String),
    /// The network thread or the emulated network.
    #[error("cannot start the network: {0}")]
    Network(std::io::Error),
}
