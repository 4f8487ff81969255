//! What the compute passes write, and how it is read back.

use camera::Pinhole;
use glam::DVec2;
use gpu::{Gpu, Readback, ReadbackError};
use protocol::{Mask, PatchId};

use super::asked::Found;
use crate::account::findings::{Lacking, ascending};
use crate::discretize::Capture;

/// Words of a sample in `samples_out`, and of an address in `told`, of `server/beside/view.wgsl`.
const SAMPLE_WORDS: u32 = 6;
const ADDRESS_WORDS: u32 = 3;
/// Words of a pixel in `pixels`.
const PIXEL_WORDS: u32 = 6;
/// Counters before the marks, and their places.
const COUNTERS: u32 = 16;
const MISSING: usize = 0;
const HITS: usize = 1;
const SAMPLES: usize = 2;
const ADDRESSES: usize = 3;
/// What an address is told for.
const FALSE_COVER: u32 = 0;
const REPLACED: u32 = 1;
/// So many of each are read at once before anything is known; then a half more than were found last.
const FIRST_SAMPLES: u32 = 4096;
const FIRST_ADDRESSES: u32 = 1024;

/// How much is written at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Room {
    pub size_px: (u32, u32),
    pub samples: u32,
    /// What is beyond is left for the next look.
    pub addresses: u32,
    slots: u32,
}

/// The buffers, kept for the next view of the same size.
pub(super) struct Lists {
    pub room: Room,
    pub marks: wgpu::Buffer,
    pub pixels: wgpu::Buffer,
    pub samples: wgpu::Buffer,
    pub told: wgpu::Buffer,
    expected: [u32; 2],
}

impl Lists {
    /// Whether a device binds those of a view.
    pub fn fit(gpu: &Gpu, (width_px, height_px): (u32, u32)) -> bool {
        let pixels = u64::from(width_px) * u64::from(height_px);
        let most_words = SAMPLE_WORDS.max(PIXEL_WORDS).max(2 * ADDRESS_WORDS);
        pixels * u64::from(most_words) * 4 <= gpu.most_storage_bytes()
    }

    /// Those that are kept, where they have room.
    pub fn taken(kept: Option<Lists>, gpu: &Gpu, size_px: (u32, u32), slots: u32) -> Lists {
        let fits = |kept: &Lists| kept.room.size_px == size_px && kept.room.slots >= slots;
        kept.filter(fits).unwrap_or_else(|| Lists::new(gpu, size_px, slots.next_power_of_two()))
    }

    fn new(gpu: &Gpu, size_px: (u32, u32), slots: u32) -> Lists {
        let pixels = size_px.0 * size_px.1;
        let buffer = |label, words: u32| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: u64::from(words) * 4,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Lists {
            room: Room { size_px, samples: pixels, addresses: 2 * pixels, slots },
            marks: buffer("marks of samples", COUNTERS + slots),
            pixels: buffer("verdicts", PIXEL_WORDS * pixels),
            samples: buffer("samples to send", SAMPLE_WORDS * pixels),
            told: buffer("addresses", ADDRESS_WORDS * 2 * pixels),
            expected: [FIRST_SAMPLES, FIRST_ADDRESSES],
        }
    }

    /// Counters and marks are of one comparison.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.marks, 0, None);
    }

    /// Submits what is encoded and waits for what it wrote: at once as much as is expected, and then what is more.
    pub fn read(&mut self, gpu: &Gpu, mut encoder: wgpu::CommandEncoder) -> Result<Read, ReadbackError> {
        let room = [self.room.samples, self.room.addresses];
        let first = [0, 1].map(|list| self.expected[list].min(room[list]));
        let mut readback = Readback::default();
        let counters = readback.buffer(&self.marks, 0, COUNTERS * 4);
        let slots = self.slots(&mut readback, [0; 2], first);
        let encoded = readback.encode(gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(gpu)?;
        let counters: Vec<u32> = mapped.values(counters);
        let found = [counters[SAMPLES].min(room[0]), counters[ADDRESSES].min(room[1])];
        let [mut samples, mut told] = slots.map(|slot| mapped.values::<u32>(slot));
        if (0..2).any(|list| found[list] > first[list]) {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut readback = Readback::default();
            let more = [0, 1].map(|list| found[list].saturating_sub(first[list]).max(1).min(room[list] - first[list]));
            let slots = self.slots(&mut readback, first, more);
            let encoded = readback.encode(gpu, &mut encoder);
            gpu.queue.submit([encoder.finish()]);
            let mapped = encoded.map().wait(gpu)?;
            samples.extend(mapped.values::<u32>(slots[0]));
            told.extend(mapped.values::<u32>(slots[1]));
        }
        samples.truncate((found[0] * SAMPLE_WORDS) as usize);
        told.truncate((found[1] * ADDRESS_WORDS) as usize);
        self.expected = [(found[0] + found[0] / 2).max(FIRST_SAMPLES), (found[1] + found[1] / 2).max(FIRST_ADDRESSES)];
        Ok(Read { counters, samples, told })
    }

    fn slots(&self, readback: &mut Readback, first: [u32; 2], count: [u32; 2]) -> [gpu::Slot; 2] {
        let lists = [(&self.samples, SAMPLE_WORDS), (&self.told, ADDRESS_WORDS)];
        [0, 1].map(|list| {
            let (buffer, words) = lists[list];
            readback.buffer(buffer, u64::from(first[list] * words) * 4, count[list] * words * 4)
        })
    }
}

/// The lists as they came.
pub(super) struct Read {
    counters: Vec<u32>,
    samples: Vec<u32>,
    told: Vec<u32>,
}

impl Read {
    /// What they say of a camera's view.
    pub fn found(&self, camera: &Pinhole, least_px: f64) -> Found {
        let (mut false_cover, mut replaced, mut superseded) = (Vec::new(), Vec::new(), Vec::new());
        for address in self.told.chunks_exact(ADDRESS_WORDS as usize) {
            let list = match address[2] {
                FALSE_COVER => &mut false_cover,
                REPLACED => &mut replaced,
                _ => &mut superseded,
            };
            list.push((PatchId(address[0]), address[1] as u16, (address[1] >> 16) as u16));
        }
        [&mut false_cover, &mut replaced, &mut superseded].into_iter().for_each(ascending);
        let missing = self.counters[MISSING] as usize;
        let is_enough = missing as f64 > least_px;
        let (capture, send) = self.part(camera);
        let lacking = Lacking {
            send,
            missing: if is_enough { missing } else { 0 },
            replaced: if is_enough { replaced } else { Vec::new() },
        };
        Found { capture, lacking, false_cover, superseded, hits: self.counters[HITS] as usize }
    }

    /// The smallest part of the view that has all samples that are to be sent, and nothing else.
    fn part(&self, camera: &Pinhole) -> (Capture, Mask) {
        let width_px = camera.width_px;
        let samples = || self.samples.chunks_exact(SAMPLE_WORDS as usize);
        let place = |sample: &[u32]| (sample[0] % width_px, sample[0] / width_px);
        let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
        for sample in samples() {
            let (x, y) = place(sample);
            (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
        }
        let is_empty = self.samples.is_empty();
        let (origin, size) =
            if is_empty { ([0; 2], [1; 2]) } else { (low, [high[0] - low[0] + 1, high[1] - low[1] + 1]) };
        let camera = Pinhole {
            width_px: size[0],
            height_px: size[1],
            centre_px: camera.centre_px - DVec2::new(origin[0].into(), origin[1].into()),
            ..*camera
        };
        let pixels = size[0] as usize * size[1] as usize;
        let mut capture = Capture {
            camera,
            ids: vec![[0; 2]; pixels],
            colour: vec![[0; 4]; pixels],
            rests: vec![[0; 2]; pixels],
            hides: Vec::new(),
            depth: vec![0.0; pixels],
            ends: vec![0; pixels],
            gpu_s: None,
        };
        let mut send = Mask::empty(size[0], size[1]);
        for sample in samples() {
            let (x, y) = place(sample);
            let (x, y) = (x - origin[0], y - origin[1]);
            let at = y as usize * size[0] as usize + x as usize;
            capture.ids[at] = [sample[1], sample[2]];
            capture.colour[at] = sample[3].to_le_bytes();
            let [normal, colour, ..] = sample[4].to_le_bytes();
            capture.rests[at] = [normal, colour];
            capture.ends[at] = (sample[4] >> 16) as u16;
            capture.depth[at] = f32::from_bits(sample[5]);
            send.set(x, y, true);
        }
        (capture, send)
    }
}
