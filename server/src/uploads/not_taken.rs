//! Why something that a person brings is not taken.

use axum::http::StatusCode;
use thiserror::Error;

/// Why something is not taken.
#[derive(Debug, Error)]
pub enum NotTaken {
    /// The request is no upload.
    #[error("an upload begins with a line of JSON that lists its files: {0}")]
    Manifest(String),
    /// A file's path leads out of the upload, or is none.
    #[error("{0:?} is no path of a file within an upload")]
    Path(String),
    /// It is larger than any may be.
    #[error("it has {} MiB, and one upload may have {}", .bytes.div_ceil(1 << 20), .most >> 20)]
    Large {
        /// Its size.
        bytes: u64,
        /// What one may have.
        most: u64,
    },
    /// There are more files than there may be.
    #[error("it has {files} files, and one upload may have {most}")]
    Many {
        /// How many.
        files: usize,
        /// As many as may be.
        most: usize,
    },
    /// Others have brought too much.
    #[error(
        "there is no room for it now beside what others have brought; what nobody looks at is removed after a while"
    )]
    Full,
    /// Others are bringing something.
    #[error("as many as may be are bringing something now")]
    Crowded,
    /// Nothing came for a while.
    #[error("nothing came for {0} s")]
    Slow(u64),
    /// It ended early, or was more than it said.
    #[error("its bytes are not those that it lists")]
    Length,
    /// The archive cannot be unpacked.
    #[error("the archive cannot be unpacked: {0}")]
    Archive(String),
    /// Nothing of it can be shown.
    #[error("there is no scene file in it (glTF, GLB, OBJ, PLY, STL, or a ZIP of one)")]
    NoScene,
    /// The disk.
    #[error("it cannot be kept: {0}")]
    Disk(#[from] std::io::Error),
}

impl NotTaken {
    /// Of the answer.
    pub(crate) fn status(&self) -> StatusCode {
        match self {
            NotTaken::Manifest(_) | NotTaken::Path(_) | NotTaken::Length => StatusCode::BAD_REQUEST,
            NotTaken::Large { .. } | NotTaken::Many { .. } => StatusCode::PAYLOAD_TOO_LARGE,
            NotTaken::Full | NotTaken::Disk(_) => StatusCode::INSUFFICIENT_STORAGE,
            NotTaken::Crowded => StatusCode::SERVICE_UNAVAILABLE,
            NotTaken::Slow(_) => StatusCode::REQUEST_TIMEOUT,
            NotTaken::Archive(_) | NotTaken::NoScene => StatusCode::UNPROCESSABLE_ENTITY,
        }
    }
}
