//! What a turn made: plain values.

use std::ops::Range;
use std::time::Duration;

use protocol::codec::Coding;
use protocol::held::Update;

use crate::account::Counts;
use crate::plan::Reason;

/// An update that was made, not yet coded.
#[derive(Debug, Clone)]
pub struct Made {
    /// Why it was made.
    pub reason: Reason,
    /// What it says.
    pub update: Update,
    /// How to code it.
    pub coding: Coding,
    /// What it did.
    pub counts: Counts,
    /// Pixels of the views that it was made from.
    pub pixels: u64,
    /// What of it is for lights.
    pub lights: LightWork,
}

/// What of an update is for lights.
#[derive(Debug, Clone, Default)]
pub struct LightWork {
    /// Which of the edits.
    pub edits: Range<usize>,
    /// Wall time for them.
    pub took: Duration,
}
