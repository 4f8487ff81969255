//! Accounts that came to be in the same way, and one that follows another without looking.
//!
//! A view at rest is nobody's past: its rows are as many as a path carries, and no look depends on them. So that patches of looks have the same ids whatever rows came
//! between, ids are left out for them, as long as the past may be shared.

use protocol::held::{Draft, Edit, HeldError};
use protocol::{PatchId, Purpose};
use surface::HeldSurfaces;

use super::record::Record;
use super::{Account, Counts, Known, Past, Surroundings};

/// Of patch ids each look has so many, with the rows at rest after it. Looks are of a few views, rows of a few turns; where that is not enough, the past is not
/// shared any more.
const IDS_A_LOOK: u32 = 256;

impl Known {
    /// Memory that it takes: what looks change, of all samples, and what they share, of those of the last look.
    pub fn bytes(&self) -> usize {
        let of_last_look = |record: &Record| if record.added == self.look { record.shared_bytes() } else { 0 };
        self.records.values().map(|record| record.copied_bytes() + of_last_look(record)).sum()
    }

    /// The last id that is left for patches until the next look.
    fn last_id(&self) -> u32 {
        self.look.saturating_add(1).saturating_mul(IDS_A_LOOK)
    }
}

impl Account {
    /// What looks did to it.
    pub fn past(&self) -> Past {
        if self.known.last_patch > self.known.last_id() { Past::Own } else { self.past }
    }

    /// Names what looks did to it until now.
    pub fn name_past(&mut self, past: Past) {
        self.past = past;
    }

    /// What it knows beside what it holds.
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// The next look's patches have ids that do not depend on the rows at rest since the last one.
    pub fn leave_ids_for_rest(&mut self) {
        self.known.last_patch = self.known.last_patch.max(self.known.last_id());
    }

    /// Begins an update that only repeats another account's.
    pub fn begin_draft(&mut self) {
        (self.counts, self.draft) = (Counts::default(), Draft::default());
    }

    /// Does what a look did to another one of the same past: the same edits, at a time of its own, with what that one then knew. What they add is drawn
    /// with `surfaces` when the copy is looked at next. Where views are compared on the GPU, what was seen last is only as new as that one's records.
    pub fn repeat(
        &mut self,
        edits: &[Edit],
        known: &Known,
        now: &Surroundings<'_>,
        surfaces: impl Fn() -> Option<HeldSurfaces>,
    ) -> Result<(), HeldError> {
        for edit in edits {
            let mut edit = edit.clone();
            if let Edit::Add(patch) = &mut edit {
                patch.capture_time_s = now.time_s;
                if patch.purpose.is_surface() && patch.purpose != Purpose::Occluders {
                    self.draw_with(patch.purpose, &surfaces);
                }
            }
            if let Some(id) = changed_by(&edit) {
                self.drawn.change(id);
            }
            self.held.edit(edit, &mut self.draft)?;
        }
        self.known = known.clone();
        Ok(())
    }
}

/// The patch that an edit changes.
fn changed_by(edit: &Edit) -> Option<PatchId> {
    match edit {
        Edit::Add(patch) => Some(patch.id),
        Edit::Remove(id) | Edit::Delete(id, _) | Edit::Trim(id, _) => Some(*id),
        _ => None,
    }
}
