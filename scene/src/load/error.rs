//! Why a file could not be loaded.

use std::path::PathBuf;

/// Why a file could not be loaded. Every message names what is at fault, and whose fault it is: the system's
/// ([`LoadError::Io`]), this program's ([`LoadError::Unsupported`], [`LoadError::TooLarge`]) or the file's.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The system could not read a file.
    #[error("cannot read {path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither content nor extension names a format that is read here.
    #[error("{path}: not a glTF, GLB, OBJ, PLY or STL file", path = path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A size is past its cap in [`super::LoadLimits`].
    #[error("{what}: {found} is more than the limit of {limit}")]
    TooLarge {
        /// The size that was measured.
        what: String,
        /// As claimed or found in the file.
        found: u64,
        /// The cap.
        limit: u64,
    },
    /// The file needs a feature that is not read here.
    #[error("{feature} is not supported: {hint}")]
    Unsupported {
        /// The feature, by the name that its specification gives it.
        feature: String,
        /// What can be done about it.
        hint: String,
    },
    /// The file breaks its format.
    #[error("{at}: {fault}")]
    Malformed {
        /// Where, as a path into the file such as `meshes[0].primitives[1].indices`.
        at: String,
        /// What is wrong there.
        fault: String,
    },
    /// The file has no such thing as was chosen of it.
    #[error("there is no {what} {chosen:?}; there are: {there}")]
    NotThere {
        /// What was chosen: a scene, a variant, a camera.
        what: &'static str,
        /// As given.
        chosen: String,
        /// The names of those there are.
        there: String,
    },
    /// A file refers to something outside of its own folder.
    #[error("{uri:?} is refused: {reason}")]
    Outside {
        /// As written in the file.
        uri: String,
        /// Which rule it breaks.
        reason: &'static str,
    },
    /// Nothing is left to draw.
    #[error("nothing to draw: {reason}")]
    NothingToDraw {
        /// Why, with the warnings that led there.
        reason: String,
    },
}

impl LoadError {
    /// Shorthand for [`LoadError::Malformed`].
    pub(super) fn malformed(at: impl Into<String>, fault: impl Into<String>) -> LoadError {
        LoadError::Malformed { at: at.into(), fault: fault.into() }
    }

    /// Fails where `found` is past `limit`.
    pub(super) fn check_limit(what: impl Into<String>, found: u64, limit: u64) -> Result<(), LoadError> {
        if found <= limit { Ok(()) } else { Err(LoadError::TooLarge { what: what.into(), found, limit }) }
    }
}
