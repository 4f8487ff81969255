//! What is known of held samples beside what a view shows of them, kept on the GPU for comparisons there: the twin of the records.
//!
//! Samples lie in slots, those of a patch one after the other, patches by their ids. A word of 32 pixels of a patch's image says which of
//! them were captured, which are still held, and where the first one's slot is. A patch's slots stay empty when it is removed; once most are, all move
//! together.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use gpu::{Gpu, Readback, ReadbackError};
use protocol::held::{HeldPatch, PatchId};
use protocol::image::Ranks;
use protocol::{Held, Purpose};

use super::record::Record;

/// `Sample` of `server/beside/view.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SampleFacts {
    triangle: u32,
    /// Samples an area, 1/m².
    density: f32,
    /// Inverse depth, 1/m.
    w: f32,
    /// x in the low half, y in the high one.
    pixel: u32,
    /// Octahedral normal in the low half, object in the high one; 0 of what was deleted at once.
    normal_object: u32,
    /// 1 + the number of its object among the patch's moving ones; 0 of what never moves.
    mover: u32,
}

/// `Word` of `server/beside/view.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Word {
    captured: u32,
    held: u32,
    first_slot: u32,
    padding: u32,
}

/// Where a patch's facts lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Its first word.
    pub first_word: u32,
    words: u32,
    /// The slot of its first sample.
    pub first_slot: u32,
    /// Its samples, deleted ones too.
    pub slots: u32,
    /// Of its image, in pixels.
    pub width_px: u32,
}

/// Slots of removed patches are put up with up to this many, or as many as are in use.
const LEAST_EMPTY_SLOTS: u32 = 1 << 14;
/// Room that a buffer begins with, in bytes.
const LEAST_BYTES: u64 = 1 << 16;

/// See the module.
#[derive(Debug)]
pub struct Facts {
    gpu: Gpu,
    places: BTreeMap<PatchId, Place>,
    words: Growing,
    samples: Growing,
    /// By slot: the last look that showed it in a comparison on the GPU.
    seen: Growing,
    /// Patches that were added, removed or deleted from.
    changed: BTreeSet<PatchId>,
    /// Whether they no longer fit into what the device binds: then nothing is known here any more.
    is_full: bool,
}

impl Facts {
    /// Of nothing yet, with everything of a copy still to be followed.
    pub fn new(gpu: &Gpu, held: &Held) -> Facts {
        let growing = |label| Growing::new(gpu, label);
        Facts {
            gpu: gpu.clone(),
            places: BTreeMap::new(),
            words: growing("words of patches"),
            samples: growing("facts of samples"),
            seen: growing("last looks of samples"),
            changed: held.patches.keys().copied().collect(),
            is_full: false,
        }
    }

    /// A patch was added or removed, or samples of it were deleted.
    pub fn change(&mut self, id: PatchId) {
        self.changed.insert(id);
    }

    /// All was forgotten; what comes next may fit again.
    pub fn clear(&mut self) {
        self.changed.clear();
        self.is_full = false;
        self.forget_all();
    }

    fn forget_all(&mut self) {
        self.places.clear();
        [&mut self.words, &mut self.samples, &mut self.seen].into_iter().for_each(|buffer| buffer.used_bytes = 0);
    }

    /// Follows what changed.
    pub(super) fn refresh(&mut self, held: &Held, records: &BTreeMap<PatchId, Arc<Record>>) {
        for id in std::mem::take(&mut self.changed) {
            if self.is_full {
                return;
            }
            let patch = held.patches.get(&id).filter(|held| held.patch.purpose == Purpose::Eye);
            let (Some(patch), Some(record)) = (patch, records.get(&id)) else {
                self.places.remove(&id);
                continue;
            };
            match self.places.get(&id) {
                Some(place) => {
                    let words = words(patch, record, place.first_slot);
                    self.words.write(&self.gpu, place.first_word, &words);
                }
                None => self.add(id, patch, record),
            }
        }
    }

    fn add(&mut self, id: PatchId, patch: &HeldPatch, record: &Record) {
        let (first_word, first_slot) = (self.words.len::<Word>(), self.samples.len::<SampleFacts>());
        let (words, samples) = (words(patch, record, first_slot), samples(patch, record));
        self.is_full = !self.words.has_room(&self.gpu, &words) || !self.samples.has_room(&self.gpu, &samples);
        if self.is_full {
            return self.forget_all();
        }
        self.words.push(&self.gpu, &words);
        self.samples.push(&self.gpu, &samples);
        let seen: Vec<u32> = record.last_looks().collect();
        self.seen.push(&self.gpu, &seen);
        let (words, slots, width_px) = (words.len() as u32, samples.len() as u32, record.mask().size_px().0);
        self.places.insert(id, Place { first_word, words, first_slot, slots, width_px });
    }

    /// Tells the records which look showed each sample last, and moves all facts together where most slots are empty.
    pub(super) fn settle(
        &mut self,
        held: &Held,
        records: &mut BTreeMap<PatchId, Arc<Record>>,
        wants_seen: bool,
    ) -> Result<(), ReadbackError> {
        let in_use: u32 = self.places.values().map(|place| place.slots).sum();
        let is_wasteful = self.slots() - in_use > in_use.max(LEAST_EMPTY_SLOTS);
        if !wants_seen && !is_wasteful {
            return Ok(());
        }
        self.tell_seen(records)?;
        if is_wasteful {
            self.changed.extend(self.places.keys());
            self.forget_all();
            self.refresh(held, records);
        }
        Ok(())
    }

    fn tell_seen(&self, records: &mut BTreeMap<PatchId, Arc<Record>>) -> Result<(), ReadbackError> {
        if self.slots() == 0 {
            return Ok(());
        }
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let slot = readback.buffer(&self.seen.buffer, 0, self.seen.used_bytes as u32);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let seen: Vec<u32> = encoded.map().wait(&self.gpu)?.values(slot);
        for (id, place) in &self.places {
            if let Some(record) = records.get_mut(id).map(Arc::make_mut) {
                let of_patch = &seen[place.first_slot as usize..(place.first_slot + place.slots) as usize];
                record.seen_too(of_patch);
            }
        }
        Ok(())
    }

    /// Whether everything that is held is known here.
    pub fn is_whole(&self) -> bool {
        !self.is_full
    }

    /// By patch, ids ascending.
    pub fn places(&self) -> impl ExactSizeIterator<Item = (PatchId, Place)> {
        self.places.iter().map(|(id, place)| (*id, *place))
    }

    /// Slots so far, empty ones too.
    pub fn slots(&self) -> u32 {
        self.samples.len::<SampleFacts>()
    }

    /// [`Word`]s, [`SampleFacts`], and the last looks.
    pub fn buffers(&self) -> [&wgpu::Buffer; 3] {
        [&self.words.buffer, &self.samples.buffer, &self.seen.buffer]
    }
}

fn words(patch: &HeldPatch, record: &Record, first_slot: u32) -> Vec<Word> {
    let halves = |words: &[u64]| words.iter().flat_map(|word| [*word as u32, (word >> 32) as u32]).collect::<Vec<_>>();
    let (captured, held) = (halves(record.mask().words()), halves(patch.patch.image.mask.words()));
    let mut first_slot = first_slot;
    let word = |(captured, held): (u32, u32)| {
        let word = Word { captured, held, first_slot, padding: 0 };
        first_slot += captured.count_ones();
        word
    };
    captured.into_iter().zip(held).map(word).collect()
}

fn samples(patch: &HeldPatch, record: &Record) -> Vec<SampleFacts> {
    let image = &patch.patch.image;
    let ranks = Ranks::new(&image.mask);
    let mover = |object: u16| {
        let number = patch.patch.objects.binary_search_by_key(&object, |pose| pose.object);
        number.map_or(0, |number| number as u32 + 1)
    };
    let sample = |((x, y), sample): ((u32, u32), &super::record::Sample)| {
        let rank = ranks.of(&image.mask, x as u16, y as u16);
        let [low, high] = rank.map_or([0; 2], |rank| image.normal[rank]);
        let object = rank.map_or(0, |rank| image.object[rank]);
        SampleFacts {
            triangle: sample.triangle,
            density: sample.density,
            w: sample.w,
            pixel: x | y << 16,
            normal_object: u32::from_le_bytes([low, high, 0, 0]) | u32::from(object) << 16,
            mover: mover(object),
        }
    };
    record.mask().occupied().zip(record.samples()).map(sample).collect()
}

/// A buffer that grows at its end.
#[derive(Debug)]
struct Growing {
    label: &'static str,
    buffer: wgpu::Buffer,
    used_bytes: u64,
}

impl Growing {
    fn new(gpu: &Gpu, label: &'static str) -> Growing {
        Growing { label, buffer: Growing::buffer(gpu, label, LEAST_BYTES), used_bytes: 0 }
    }

    fn buffer(gpu: &Gpu, label: &'static str, bytes: u64) -> wgpu::Buffer {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn len<T>(&self) -> u32 {
        (self.used_bytes / size_of::<T>() as u64) as u32
    }

    fn bytes_with<T: Pod>(&self, values: &[T]) -> u64 {
        (self.used_bytes + size_of_val(values) as u64).next_power_of_two()
    }

    /// Whether the device binds what it would be with some values more.
    fn has_room<T: Pod>(&self, gpu: &Gpu, values: &[T]) -> bool {
        self.bytes_with(values) <= gpu.most_storage_bytes()
    }

    fn push<T: Pod>(&mut self, gpu: &Gpu, values: &[T]) {
        let wanted = self.used_bytes + size_of_val(values) as u64;
        if wanted > self.buffer.size() {
            let larger = Growing::buffer(gpu, self.label, self.bytes_with(values));
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, self.used_bytes);
            gpu.queue.submit([encoder.finish()]);
            self.buffer = larger;
        }
        let first = self.len::<T>();
        self.used_bytes = wanted;
        self.write(gpu, first, values);
    }

    fn write<T: Pod>(&self, gpu: &Gpu, first: u32, values: &[T]) {
        let offset = u64::from(first) * size_of::<T>() as u64;
        gpu.queue.write_buffer(&self.buffer, offset, bytemuck::cast_slice(values));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_are_laid_out_as_in_wgsl() {
        let path = "server/beside/view.wgsl";
        shaders::assert_layout!(SampleFacts, path, "Sample", triangle, density, w, pixel, normal_object, mover);
        shaders::assert_layout!(Word, path, "Word", captured, held, first_slot, padding);
    }
}
