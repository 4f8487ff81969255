//! What every format's loader is given beside the bytes.

use super::choice::Choice;
use super::limits::{LoadLimits, Progress, Stage};
use super::source::Folder;

/// See the module.
pub(super) struct Request<'a> {
    /// The scene's name.
    pub name: String,
    /// Where files that the scene refers to must lie.
    pub folder: Folder,
    pub choice: &'a Choice,
    pub limits: &'a LoadLimits,
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

impl Request<'_> {
    pub fn report(&self, stage: Stage, done: usize, of: usize) {
        (self.progress)(Progress { stage, share: done as f64 / of.max(1) as f64 });
    }
}
