//! Why bytes are refused.

use thiserror::Error;

use crate::bytes::EndsEarly;

/// Why the bytes of a patch or an update were refused. The sender, or what lies between, is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CodecError {
    /// The bytes end before the patch does.
    #[error(transparent)]
    EndsEarly(#[from] EndsEarly),
    /// Past one of the [`Limits`](crate::Limits).
    #[error("more {0} than allowed")]
    TooMuch(&'static str),
    /// Bytes that no coder writes.
    #[error("damaged: {0}")]
    Damaged(&'static str),
}
