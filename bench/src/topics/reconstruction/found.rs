//! What was found.

use protocol::DepthImage;

use super::cover::{Shares, Verdict};
use crate::compare::{Picture, Scores};

/// What was found at one eye.
pub(super) struct Found {
    pub shares: Shares,
    pub scores: Scores,
    pub times_ms: [f64; 3],
    pub encoded_bytes: f64,
    pub raw_bytes: f64,
    pub samples: f64,
}

/// A frame that waits for its scores.
pub(super) struct Shown {
    pub eye: usize,
    pub drawn: Picture,
    pub verdicts: Vec<Verdict>,
    pub times_ms: [f64; 3],
    pub images: Vec<DepthImage>,
}

/// Names of [`Found::times_ms`].
pub(super) const STAGES: [&str; 3] = ["images", "build", "frame"];
