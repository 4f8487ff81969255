//! Why nothing could be done as told.

use thiserror::Error;

/// See the module.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// On the command line or in the environment; or what was asked for is but help.
    #[error(transparent)]
    Usage(#[from] clap::Error),
    /// The file is not there.
    #[error("cannot read {file}: {reason}")]
    Unreadable {
        /// Which.
        file: String,
        /// The system's reason.
        reason: std::io::Error,
    },
    /// Something in it is wrong.
    #[error("{place}: {message}")]
    InFile {
        /// The file, and the line in it.
        place: String,
        /// What.
        message: String,
    },
}
