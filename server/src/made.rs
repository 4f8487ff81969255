//! What a turn made: plain values.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use protocol::codec::{CodedSamples, Coding};
use protocol::held::Update;
use protocol::wire::{self, EncodedUpdate};

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
    /// Pixels of the views that it was made from; 0 where nothing in view is shown by samples.
    pub pixels: u64,
    /// What of it is for lights.
    pub lights: LightWork,
    /// Its samples as they are coded, for all updates that add the same.
    pub coded: Arc<Coded>,
}

impl Made {
    /// Its bytes.
    pub fn encoded(&self) -> EncodedUpdate {
        wire::encode_update_with(&self.update, &self.coded.of(&self.update, self.coding))
    }
}

/// Coded samples of updates that add the same: what was coded for one of them does for all.
#[derive(Debug, Default)]
pub struct Coded(Mutex<Vec<Arc<CodedSamples>>>);

impl Coded {
    fn of(&self, update: &Update, coding: Coding) -> Arc<CodedSamples> {
        // A coding is added whole.
        let mut coded = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = coded.iter().find(|samples| samples.coding == coding) {
            return known.clone();
        }
        let samples = Arc::new(CodedSamples::of(&update.edits, coding));
        coded.push(samples.clone());
        samples
    }
}

/// What of an update is for lights.
#[derive(Debug, Clone, Default)]
pub struct LightWork {
    /// Which of the edits.
    pub edits: Range<usize>,
    /// Wall time for them.
    pub took: Duration,
}

/// What came of a look beside samples.
#[derive(Default)]
pub struct Came {
    /// Whether all was looked at that there is.
    pub has_ended: bool,
    /// What of it is for lights.
    pub lights: LightWork,
}
