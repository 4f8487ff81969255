//! The buffers of a surface, written piece by piece, so that a large one fits between frames.

use gpu::Gpu;
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor};

use super::source::{Content, Source};
use crate::mesh::Vertex;

#[derive(Debug)]
pub(super) struct Upload {
    buffers: [Buffer; 2],
    /// Bytes of each.
    written: [usize; 2],
}

const CONTENTS: [Content; 2] = [Content::Vertices, Content::Indices];

fn buffer(gpu: &Gpu, content: Content, size: usize) -> Buffer {
    let (label, usage) = match content {
        // Copied where more are added.
        Content::Vertices => ("corners", BufferUsages::VERTEX | BufferUsages::COPY_SRC),
        Content::Indices => ("quads", BufferUsages::INDEX),
    };
    // Compute shaders read them too: see [`crate::FlattenPass`].
    let read = if gpu.caps.compute { BufferUsages::STORAGE } else { BufferUsages::empty() };
    let usage = usage | BufferUsages::COPY_DST | read;
    gpu.device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size: size as u64,
        usage,
        mapped_at_creation: false,
    })
}

/// A buffer of the same vertices with room for so many in all.
pub(crate) fn with_room(gpu: &Gpu, vertices: &Buffer, count: usize) -> Buffer {
    let larger = buffer(gpu, Content::Vertices, count * size_of::<Vertex>());
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("room for corners") });
    encoder.copy_buffer_to_buffer(vertices, 0, &larger, 0, vertices.size());
    gpu.queue.submit([encoder.finish()]);
    larger
}

impl Upload {
    /// Empty buffers for what a source has.
    pub fn new(gpu: &Gpu, source: &Source) -> Upload {
        let buffers = CONTENTS.map(|content| buffer(gpu, content, source.size(content)));
        Upload { buffers, written: [0; 2] }
    }

    /// Writes so many bytes more at most; whether all are written.
    pub fn write(&mut self, gpu: &Gpu, source: &Source, most_bytes: &mut usize) -> bool {
        let mut is_whole = true;
        for ((content, buffer), written) in CONTENTS.into_iter().zip(&self.buffers).zip(&mut self.written) {
            let end = source.size(content).min(written.saturating_add(*most_bytes));
            if end > *written {
                gpu.queue.write_buffer(buffer, *written as u64, &source.piece(content, *written..end));
                *most_bytes -= end - *written;
                *written = end;
            }
            is_whole &= end == source.size(content);
        }
        is_whole
    }

    /// Vertices and indices.
    pub fn into_buffers(self) -> [Buffer; 2] {
        self.buffers
    }
}
