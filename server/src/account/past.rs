//! Accounts that came to be in the same way, and one that follows another without looking.

use protocol::held::{Edit, HeldError};
use protocol::{PatchId, Purpose};
use surface::HeldSurfaces;

use super::{Account, Known, Surroundings};

/// What was ever done to an account. Accounts of equal pasts that are not [`Past::Own`] differ in nothing but times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Past {
    /// Nothing.
    #[default]
    None,
    /// What others may have been through, by its number.
    Shared(u64),
    /// What nobody else has.
    Own,
}

impl Known {
    /// Memory that it takes at most.
    pub fn bytes(&self) -> usize {
        self.records.values().map(|record| record.bytes()).sum()
    }
}

impl Account {
    /// What was done to it.
    pub fn past(&self) -> Past {
        self.past
    }

    /// What it knows beside what it holds.
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// The edits of the update so far, for others of the same past.
    pub fn edits_so_far(&self) -> &[Edit] {
        self.draft.edits()
    }

    /// Names what was done to it until now.
    pub fn name_past(&mut self, past: Past) {
        self.past = past;
    }

    /// Does what was done to another one of the same past: the same edits, at a time of its own, with what that one then knew. What they add is drawn with
    /// `surfaces` when the copy is looked at next.
    pub fn repeat(
        &mut self,
        edits: &[Edit],
        known: &Known,
        now: &Surroundings<'_>,
        surfaces: impl Fn() -> Option<HeldSurfaces>,
    ) -> Result<(), HeldError> {
        (self.counts, self.draft) = Default::default();
        for edit in edits {
            let mut edit = edit.clone();
            if let Edit::Add(patch) = &mut edit {
                patch.capture_time_s = now.time_s;
                self.draw_as(patch.purpose, &surfaces);
            }
            if let Some(id) = changed_by(&edit) {
                self.drawn.change(id);
            }
            self.held.edit(edit, &mut self.draft)?;
        }
        self.known = known.clone();
        Ok(())
    }

    fn draw_as(&mut self, purpose: Purpose, surfaces: impl Fn() -> Option<HeldSurfaces>) {
        if purpose.is_surface() && purpose != Purpose::Occluders {
            self.draw_with(purpose, surfaces);
        }
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
