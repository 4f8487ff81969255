//! Copies of textures and buffers to the CPU, several in flight.
//!
//! ```text
//! let mut readback = Readback::default();
//! let slot = readback.texture(&colour, 0, (w, h));   // what to copy
//! let encoded = readback.encode(&gpu, &mut encoder); // copies in the order of the encoder's passes
//! gpu.queue.submit([encoder.finish()]);
//! let pending = encoded.map();                       // asks for the bytes
//! … later: pending.is_ready(), or pending.wait(&gpu) natively
//! let mapped = pending.take()?;  mapped.rows(slot) / mapped.bytes(slot)
//! ```

use std::sync::{Arc, OnceLock};

use wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as ROW_ALIGNMENT;

use crate::{Gpu, GpuError};

/// Why bytes did not come back.
#[derive(Debug, thiserror::Error)]
pub enum ReadbackError {
    /// The buffer could not be mapped.
    #[error("mapping the readback buffer failed: {0}")]
    Map(String),
    /// Asked before it was ready.
    #[error("the readback is not ready")]
    NotReady,
    /// The device went away.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// One thing that is copied; the key to its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot(usize);

#[derive(Debug, Clone)]
struct Region {
    offset: u64,
    row_bytes: u32,
    /// Aligned as copies need it.
    stride_bytes: u32,
    rows: u32,
    source: Source,
}

#[derive(Debug, Clone)]
enum Source {
    Texture { texture: wgpu::Texture, layer: u32, size_px: (u32, u32) },
    Buffer { buffer: wgpu::Buffer, offset: u64 },
}

/// Collects what to copy.
#[derive(Debug, Default)]
pub struct Readback {
    regions: Vec<Region>,
    bytes: u64,
}

impl Readback {
    /// Copies the top left `size_px` of mip level 0 of an array layer. The format must be one that can be copied, with a
    /// single aspect (depth32float can).
    pub fn texture(&mut self, texture: &wgpu::Texture, layer: u32, size_px: (u32, u32)) -> Slot {
        let texel_bytes = texture.format().block_copy_size(None).expect("a format of one copyable aspect");
        let row_bytes = size_px.0 * texel_bytes;
        let source = Source::Texture { texture: texture.clone(), layer, size_px };
        self.push(row_bytes, row_bytes.next_multiple_of(ROW_ALIGNMENT), size_px.1, source)
    }

    /// Copies `bytes` of a buffer from `offset`; both are multiples of 4.
    pub fn buffer(&mut self, buffer: &wgpu::Buffer, offset: u64, bytes: u32) -> Slot {
        let source = Source::Buffer { buffer: buffer.clone(), offset };
        self.push(bytes, bytes.next_multiple_of(ROW_ALIGNMENT), 1, source)
    }

    fn push(&mut self, row_bytes: u32, stride_bytes: u32, rows: u32, source: Source) -> Slot {
        self.regions.push(Region { offset: self.bytes, row_bytes, stride_bytes, rows, source });
        self.bytes += u64::from(stride_bytes) * u64::from(rows);
        Slot(self.regions.len() - 1)
    }

    /// Encodes the copies, after what the encoder holds so far.
    pub fn encode(self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Encoded {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: self.bytes.max(u64::from(ROW_ALIGNMENT)),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        for region in &self.regions {
            match &region.source {
                Source::Texture { texture, layer, size_px } => encoder.copy_texture_to_buffer(
                    wgpu::TexelCopyTextureInfo {
                        texture,
                        mip_level: 0,
                        origin: wgpu::Origin3d { x: 0, y: 0, z: *layer },
                        aspect: wgpu::TextureAspect::All,
                    },
                    wgpu::TexelCopyBufferInfo {
                        buffer: &buffer,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: region.offset,
                            bytes_per_row: Some(region.stride_bytes),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: 1 },
                ),
                Source::Buffer { buffer: from, offset } => {
                    encoder.copy_buffer_to_buffer(from, *offset, &buffer, region.offset, u64::from(region.row_bytes));
                }
            }
        }
        Encoded { buffer, regions: self.regions }
    }
}

/// Copies that are encoded but perhaps not submitted.
#[derive(Debug)]
pub struct Encoded {
    buffer: wgpu::Buffer,
    regions: Vec<Region>,
}

impl Encoded {
    /// Asks for the bytes. Call it after the encoder's commands were submitted.
    pub fn map(self) -> Pending {
        let state = Arc::new(OnceLock::new());
        let told = Arc::clone(&state);
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            told.get_or_init(|| result.map_err(|error| error.to_string()));
        });
        Pending { buffer: self.buffer, regions: self.regions, state }
    }
}

/// Bytes that are on their way.
#[derive(Debug)]
pub struct Pending {
    buffer: wgpu::Buffer,
    regions: Vec<Region>,
    state: Arc<OnceLock<Result<(), String>>>,
}

impl Pending {
    /// Whether [`Pending::take`] will not fail with [`ReadbackError::NotReady`]. Something must poll the device meanwhile
    /// ([`Gpu::poll`]; a browser does it by itself).
    pub fn is_ready(&self) -> bool {
        self.state.get().is_some()
    }

    /// The bytes, where they have arrived.
    pub fn take(self) -> Result<Mapped, ReadbackError> {
        match self.state.get() {
            None => Err(ReadbackError::NotReady),
            Some(Err(why)) => Err(ReadbackError::Map(why.clone())),
            Some(Ok(())) => {
                let view = self.buffer.get_mapped_range(..).map_err(|error| ReadbackError::Map(error.to_string()))?;
                Ok(Mapped { view, regions: self.regions })
            }
        }
    }

    /// Waits for the bytes. Natively only.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn wait(self, gpu: &Gpu) -> Result<Mapped, ReadbackError> {
        while !self.is_ready() {
            gpu.wait_idle()?;
        }
        self.take()
    }
}

/// Bytes that have arrived.
#[derive(Debug)]
pub struct Mapped {
    view: wgpu::BufferView,
    regions: Vec<Region>,
}

impl Mapped {
    /// The rows of a slot, top to bottom, without padding. A buffer is one row.
    pub fn rows(&self, slot: Slot) -> impl ExactSizeIterator<Item = &[u8]> + Clone + '_ {
        let region = &self.regions[slot.0];
        let (offset, stride, row_bytes) =
            (region.offset as usize, region.stride_bytes as usize, region.row_bytes as usize);
        (0..region.rows as usize).map(move |row| &self.view[offset + row * stride..][..row_bytes])
    }

    /// All rows of a slot, one after the other.
    pub fn bytes(&self, slot: Slot) -> Vec<u8> {
        self.rows(slot).flatten().copied().collect()
    }

    /// All rows of a slot as values of a plain type that the rows hold a whole number of.
    pub fn values<T: bytemuck::Pod>(&self, slot: Slot) -> Vec<T> {
        let region = &self.regions[slot.0];
        let mut values = Vec::with_capacity(region.row_bytes as usize / size_of::<T>().max(1) * region.rows as usize);
        for row in self.rows(slot) {
            extend_from_bytes(&mut values, row);
        }
        values
    }
}

/// Appends the whole values in `bytes`; one copy where they are aligned, as mapped rows are.
pub fn extend_from_bytes<T: bytemuck::Pod>(values: &mut Vec<T>, bytes: &[u8]) {
    match bytemuck::try_cast_slice(bytes) {
        Ok(aligned) => values.extend_from_slice(aligned),
        Err(_) => values.extend(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned::<T>)),
    }
}
