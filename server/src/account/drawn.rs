//! What draws the copy: a store of surfaces for each purpose, and which of its patches are out of date.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DAffine3;
use gpu::{Gpu, ReadbackError};
use protocol::{Held, Material, PatchId, Purpose};
use rayon::prelude::*;
use surface::HeldSurfaces;

use super::facts::Facts;
use super::record::Record;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Drawn {
    /// Only of purposes that are surfaces: what the eye sees, and what lights do.
    stores: BTreeMap<Purpose, HeldSurfaces>,
    /// Patches that the stores draw as they were, see [`Drawn::refresh`].
    changed: BTreeSet<PatchId>,
    /// Samples that they draw as they were, of other patches.
    trimmed: BTreeMap<PatchId, Vec<(u16, u16)>>,
    /// Of what the eye sees, where views are compared on the GPU.
    facts: Option<Facts>,
}

impl Drawn {
    /// A store for a purpose, from its first patch on.
    pub fn draw(&mut self, purpose: Purpose, new: impl FnOnce() -> Option<HeldSurfaces>) {
        if !self.stores.contains_key(&purpose)
            && let Some(store) = new()
        {
            self.stores.insert(purpose, store.of(purpose));
        }
    }

    /// Keeps facts of samples on the GPU from now on.
    pub fn know(&mut self, gpu: &Gpu, held: &Held) {
        self.facts.get_or_insert_with(|| Facts::new(gpu, held));
    }

    /// See [`Drawn::know`].
    pub fn facts(&self) -> Option<&Facts> {
        self.facts.as_ref()
    }

    /// See [`Facts::settle`].
    pub fn settle_facts(
        &mut self,
        held: &Held,
        records: &mut BTreeMap<PatchId, Arc<Record>>,
        wants_seen: bool,
    ) -> Result<(), ReadbackError> {
        self.facts.as_mut().map_or(Ok(()), |facts| facts.settle(held, records, wants_seen))
    }

    pub fn of(&self, purpose: Purpose) -> Option<&HeldSurfaces> {
        self.stores.get(&purpose)
    }

    pub fn clear(&mut self) {
        self.changed.clear();
        self.trimmed.clear();
        self.facts.iter_mut().for_each(Facts::clear);
        self.stores.values_mut().for_each(HeldSurfaces::clear);
    }

    pub fn set_materials(&mut self, materials: &[Material]) {
        self.stores.values_mut().for_each(|store| store.set_materials(materials));
    }

    pub fn set_poses(&mut self, poses_now: &BTreeMap<u16, DAffine3>) {
        self.stores.values_mut().for_each(|store| store.set_poses(poses_now));
    }

    /// A patch was added or removed.
    pub fn change(&mut self, id: PatchId) {
        self.changed.insert(id);
        self.facts.iter_mut().for_each(|facts| facts.change(id));
    }

    /// Samples of a patch were trimmed.
    pub fn trim(&mut self, id: PatchId, pixels: impl Iterator<Item = (u16, u16)>) {
        self.trimmed.entry(id).or_default().extend(pixels);
    }

    /// A patch was removed, and shall not be drawn any more even if it is not refreshed.
    pub fn remove(&mut self, id: PatchId) {
        self.changed.remove(&id);
        self.trimmed.remove(&id);
        self.facts.iter_mut().for_each(|facts| facts.change(id));
        self.stores.values_mut().for_each(|store| store.remove(id));
    }

    /// Samples were deleted, ascending.
    pub fn delete(&mut self, purpose: Purpose, id: PatchId, pixels: &[(u16, u16)]) {
        self.facts.iter_mut().for_each(|facts| facts.change(id));
        if !self.changed.contains(&id)
            && let Some(store) = self.stores.get_mut(&purpose)
        {
            store.delete(id, pixels);
        }
    }

    /// Brings the stores up to date.
    pub fn refresh(&mut self, held: &Held, records: &BTreeMap<PatchId, Arc<Record>>) {
        self.facts.iter_mut().for_each(|facts| facts.refresh(held, records));
        let (changed, trimmed) = (std::mem::take(&mut self.changed), std::mem::take(&mut self.trimmed));
        for (id, pixels) in trimmed.iter().filter(|(id, _)| !changed.contains(id)) {
            if let Some(patch) = held.patches.get(id)
                && let Some(store) = self.stores.get_mut(&patch.patch.purpose)
            {
                store.trim(patch, pixels);
            }
        }
        let stores = &self.stores;
        let mesh = |id: PatchId| {
            let patch = held.patches.get(&id);
            (id, patch.and_then(|patch| Some((patch, stores.get(&patch.patch.purpose)?.mesh(patch)))))
        };
        let meshes: Vec<_> = changed.into_par_iter().map(mesh).collect();
        for (id, mesh) in meshes {
            match mesh {
                Some((patch, mesh)) => {
                    self.stores.entry(patch.patch.purpose).and_modify(|store| store.place(patch, mesh));
                }
                None => self.stores.values_mut().for_each(|store| store.remove(id)),
            }
        }
    }
}
