//! Why an environment could not be read or written.

use std::path::PathBuf;

/// Why an environment could not be read or written; every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The system could not read or write the file.
    #[error("cannot use {path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither of the formats, by its first bytes.
    #[error("{path}: neither a Radiance (.hdr) nor an OpenEXR (.exr) picture", path = path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// More pixels than [`super::Environment::MAX_PIXELS`], or none.
    #[error("{path}: {width_px} x {height_px} pixels; from 1 to {most} pixels are read", path = path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// As claimed.
        width_px: u32,
        /// As claimed.
        height_px: u32,
        /// The cap.
        most: u64,
    },
    /// The file is larger than its pixels could ever need.
    #[error("{path}: more than the limit of {limit} bytes", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The cap.
        limit: u64,
    },
    /// The file breaks its format, or uses a part of it that is not read here.
    #[error("{path}: {reason}", path = path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        reason: String,
    },
}
