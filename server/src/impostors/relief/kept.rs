use std::collections::BTreeMap;

use protocol::{Held, PatchId};

use super::key::{End, Key};

/// The reliefs that a client holds.
#[derive(Debug, Clone, Default)]
pub struct KeptReliefs {
    patches: BTreeMap<Key, (PatchId, u32)>,
}

impl KeptReliefs {
    /// The patch of an image that is at least so many pixels wide.
    pub fn patch(&self, key: Key, side_px: u32, held: &Held) -> Option<PatchId> {
        let &(patch, held_px) = self.patches.get(&key)?;
        (held_px >= side_px && held.patches.contains_key(&patch)).then_some(patch)
    }

    /// Notes that a patch was added; the one whose place it takes, if any.
    pub fn replace(&mut self, key: Key, side_px: u32, patch: PatchId) -> Option<PatchId> {
        self.patches.insert(key, (patch, side_px)).map(|(old, _)| old)
    }

    /// By which images each object is shown.
    pub fn shown(&self, held: &Held) -> BTreeMap<u16, Vec<End>> {
        let key_of: BTreeMap<PatchId, Key> = self.patches.iter().map(|(&key, &(patch, _))| (patch, key)).collect();
        let mut shown: BTreeMap<u16, Vec<End>> = BTreeMap::new();
        for (object, relief) in held.instances.keys() {
            shown.entry(*object).or_default().extend(key_of.get(relief).map(|key| key.end));
        }
        shown
    }
}
