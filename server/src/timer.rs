//! How long passes take on the GPU.

use gpu::{Gpu, Readback, Slot};

/// Two timestamps for each pass: when it begins and ends.
pub(crate) struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    count: u32,
}

impl Timer {
    /// `None` where the GPU cannot tell.
    pub(crate) fn new(gpu: &Gpu, passes: u32) -> Option<Timer> {
        let count = passes * 2;
        gpu.caps.timestamps.then(|| Timer {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: u64::from(count) * 8,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            count,
        })
    }

    pub(crate) fn writes(&self, pass: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    /// Ticks in the order of passes.
    pub(crate) fn read(&self, encoder: &mut wgpu::CommandEncoder, readback: &mut Readback) -> Slot {
        encoder.resolve_query_set(&self.queries, 0..self.count, &self.resolved, 0);
        readback.buffer(&self.resolved, 0, self.count * 8)
    }
}
