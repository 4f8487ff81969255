//! Why a run failed.

use std::path::PathBuf;

use gpu::GpuError;
use thiserror::Error;

use crate::draw::picture::PictureError;
use crate::receive::address::AddressError;
use crate::receive::trust::TrustError;

/// See the module.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HeadlessError {
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
    /// The server did not answer, hung up, or broke the protocol.
    #[error("{0}")]
    Server(String),
    /// The emulated network could not be set up.
    #[error("cannot start the emulated network: {0}")]
    Network(std::io::Error),
    /// The network thread could not be started.
    #[error("cannot start the network thread: {0}")]
    Thread(std::io::Error),
    /// A file could not be written.
    #[error("cannot write {path}: {why}")]
    Write {
        /// Which.
        path: PathBuf,
        /// The system's or the encoder's reason.
        why: String,
    },
}
