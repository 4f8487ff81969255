use protocol::Purpose;

use super::findings::Lacking;
use crate::discretize::Capture;

/// What the edits of an update did, in samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Added.
    pub added: usize,
    /// Of these, only border.
    pub border: usize,
    /// Deleted: replaced by finer ones, or stale.
    pub deleted: usize,
    /// Extents halved.
    pub trimmed: usize,
    /// Evicted.
    pub evicted: usize,
    /// Of impostors: not part of what was added.
    pub impostor: usize,
    /// Of a viewer's own view at rest: not part of what was added.
    pub rest: usize,
    /// Of those added, for what will be needed next.
    pub ahead: usize,
    /// First hits looked at: what sending each view anew would have cost.
    pub anew: usize,
    /// Of what lights see: not part of the others.
    pub lights: LightCounts,
    /// Of what only occludes: not part of the others.
    pub occluders: OccluderCounts,
}

/// What an update did to occluders.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OccluderCounts {
    /// Samples added.
    pub added: usize,
    /// Samples deleted.
    pub deleted: usize,
    /// Views of the scene that were drawn.
    pub views: usize,
}

/// What an update did to images of lights.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LightCounts {
    /// Samples added.
    pub added: usize,
    /// Samples deleted.
    pub deleted: usize,
    /// Extents halved.
    pub trimmed: usize,
    /// First hits looked at: what sending each view anew would have cost.
    pub anew: usize,
    /// Views that were drawn, of the scene or of the copy.
    pub views: usize,
    /// Sets that were begun.
    pub sets: usize,
    /// Sets that were left as they are, as neither their lights nor any object moved.
    pub unchanged: usize,
    /// Lights that cast nothing on anything, and have no set.
    pub without: usize,
}

impl Counts {
    /// Whether nothing had to be changed of what the eye sees.
    pub fn is_still(&self) -> bool {
        self.added + self.deleted + self.trimmed + self.evicted == 0
    }

    pub(super) fn add(&mut self, purpose: Purpose, lacking: &Lacking) {
        let added = lacking.send.count();
        match purpose {
            Purpose::Eye | Purpose::Layer(_) => {
                self.added += added;
                self.border += added - lacking.missing;
            }
            Purpose::Occluders => self.occluders.added += added,
            _ => self.lights.added += added,
        }
    }

    pub(super) fn delete(&mut self, purpose: Purpose, samples: usize) {
        let deleted = match purpose {
            Purpose::Eye | Purpose::Layer(_) => &mut self.deleted,
            Purpose::Occluders => &mut self.occluders.deleted,
            _ => &mut self.lights.deleted,
        };
        *deleted += samples;
    }

    pub(super) fn trim(&mut self, purpose: Purpose, samples: usize) {
        *if purpose.is_for_eyes() { &mut self.trimmed } else { &mut self.lights.trimmed } += samples;
    }

    /// Notes the first hits of a view, as what sending it anew would have cost.
    pub fn look_at(&mut self, purpose: Purpose, capture: &Capture) {
        self.look_at_hits(purpose, capture.ids.iter().filter(|ids| ids[0] != 0).count());
    }

    /// The same of a view that has so many.
    pub fn look_at_hits(&mut self, purpose: Purpose, hits: usize) {
        *if purpose.is_for_eyes() { &mut self.anew } else { &mut self.lights.anew } += hits;
    }
}
