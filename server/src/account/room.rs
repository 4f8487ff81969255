//! What of a copy must go: what is no longer true, and what there is no room for.

use std::collections::BTreeMap;

use gpu::ReadbackError;
use protocol::Purpose;
use protocol::held::{HeldError, HeldPatch, PatchId};

use super::record::Record;
use super::samples::Address;
use super::{Account, Surroundings};

/// A copy over its budget shrinks to this share of it, so that it is not evicted from at every update.
const EVICT_TO: f64 = 0.9;

impl Account {
    /// Deletes the samples of deforming objects whose points are no longer where they were captured.
    pub fn delete_moved(&mut self, purpose: Purpose, now: &Surroundings<'_>) -> Result<(), HeldError> {
        if now.deforming.is_empty() {
            return Ok(());
        }
        let moved = self.surfaces_of(purpose).flat_map(|(id, held, record)| {
            let is_held = |&(x, y): &(u16, u16)| held.patch.image.mask.get(x.into(), y.into());
            record.moved(now.deforming).filter(is_held).map(move |(x, y)| (id, x, y))
        });
        let moved: Vec<Address> = moved.collect();
        self.counts.delete(purpose, moved.len());
        self.delete(&moved)
    }

    /// Deletes what the eye was least recently shown, until the copy fits `budget_samples` with some room. What this update showed
    /// stays, and so does what is for other purposes.
    pub fn evict(&mut self, budget_samples: usize) -> Result<(), HeldError> {
        // A view at rest is no surface; it has a budget of its own.
        let at_rest = self.held.patches.values().filter(|held| held.patch.purpose == Purpose::Rest);
        let at_rest: usize = at_rest.map(|held| held.patch.image.sample_count()).sum();
        let evicted = self.least_recent(Purpose::Eye, self.held.sample_count() - at_rest, budget_samples);
        self.counts.evicted += evicted.len();
        self.delete(&evicted)
    }

    /// Brings what is known on the GPU home where it is asked for next, or takes up too much there: before [`Account::evict`].
    pub fn settle_facts(&mut self, budget_samples: usize) -> Result<(), ReadbackError> {
        let is_full = self.held.sample_count() > budget_samples;
        self.drawn.settle_facts(&self.held, &mut self.known.records, is_full)
    }

    /// The same of what is held for one purpose, by itself.
    pub fn evict_of(&mut self, purpose: Purpose, budget_samples: usize) -> Result<(), HeldError> {
        let evicted = self.least_recent(purpose, self.samples_for(purpose), budget_samples);
        self.counts.delete(purpose, evicted.len());
        self.delete(&evicted)
    }

    /// Whether anything is held for a purpose.
    pub fn holds_for(&self, purpose: Purpose) -> bool {
        self.surfaces_of(purpose).next().is_some()
    }

    /// Samples that are held for a purpose.
    pub fn samples_for(&self, purpose: Purpose) -> usize {
        self.surfaces_of(purpose).map(|(_, held, _)| held.patch.image.sample_count()).sum()
    }

    /// The least recently seen of a purpose's samples, so many that of `held` about `budget` are left.
    fn least_recent(&self, purpose: Purpose, held: usize, budget: usize) -> Vec<Address> {
        if held <= budget {
            return Vec::new();
        }
        let excess = held - (budget as f64 * EVICT_TO) as usize;
        let mut by_look: BTreeMap<u32, usize> = BTreeMap::new();
        for (_, held, record) in self.surfaces_of(purpose) {
            for (x, y) in held.patch.image.mask.occupied() {
                *by_look.entry(record.seen(x as u16, y as u16).unwrap_or(0)).or_default() += 1;
            }
        }
        let mut sum = 0;
        let enough = by_look.iter().take_while(|&(&look, _)| look < self.known.look).find_map(|(&look, &count)| {
            sum += count;
            (sum >= excess).then_some(look)
        });
        let last = enough.or_else(|| self.known.look.checked_sub(1));
        last.map_or_else(Vec::new, |last| self.last_seen_by(purpose, last))
    }

    /// The surface samples of a purpose that no look after this one showed. Addresses ascend.
    fn last_seen_by(&self, purpose: Purpose, look: u32) -> Vec<Address> {
        let all = self.surfaces_of(purpose).flat_map(|(id, held, record)| {
            let places = held.patch.image.mask.occupied().map(|(x, y)| (x as u16, y as u16));
            let is_meant = |&(x, y): &(u16, u16)| record.seen(x, y).is_some_and(|seen| seen <= look);
            places.filter(is_meant).map(move |(x, y)| (id, x, y))
        });
        all.collect()
    }

    fn surfaces_of(&self, purpose: Purpose) -> impl Iterator<Item = (PatchId, &HeldPatch, &Record)> {
        let patches = self.held.patches.iter().filter(move |(_, held)| held.patch.purpose == purpose);
        patches.filter_map(|(id, held)| Some((*id, held, &**self.known.records.get(id)?)))
    }
}
