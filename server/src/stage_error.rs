//! Why an update could not be made.

use protocol::held::HeldError;
use thiserror::Error;

use crate::imager::ImagerError;

/// See the module.
#[derive(Debug, Error)]
pub enum StageError {
    /// Nothing can be drawn any more.
    #[error(transparent)]
    Imager(#[from] ImagerError),
    /// The copy took an edit amiss: a mistake in the program, or more than a client may hold.
    #[error("an update that the client could not hold: {0}")]
    Held(#[from] HeldError),
}
