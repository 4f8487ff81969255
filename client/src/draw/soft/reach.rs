//! Which casters may hide a pixel that is seen: all others are left out of the maps, such as the ground, which is a good part of most scenes.
//!
//! A pyramid of tiles over the frame's image holds the least `w` of what is seen. In the map of a lamp's point that shifts by `s` pixels at
//! `w = 1`, a caster at `w` and a receiver at `w' < w` fall together where they lie `s (w - w')` apart in the frame. So a caster reaches a box
//! around its own place, as wide as the lamp's points and the least receiver in it allow: it begins as the whole image, and shrinks to its own
//! least. What is left out would have changed nothing, as a pixel on each side is taken in besides.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::DVec2;
use gpu::Gpu;
use surface::{INVOCATIONS_A_ROW, Parallelograms, SurfaceError, dispatch};
use wgpu::{BindingResource, Buffer, BufferUsages};

use crate::draw::fullscreen::uniform;

/// Pixels of a tile's side; the twin of `TILE_PX` in `client/compute/reach.wgsl`.
const TILE_PX: u32 = 4;
/// Counts and dispatches before the places: `Kept` of the shader.
const KEPT_HEADER_WORDS: u32 = 8;
/// Where the dispatches stand in it, in bytes: of small ones, of large ones.
pub(super) const DISPATCHES: [u64; 2] = [8, 20];
/// Of any image that a device draws.
const LEVELS: usize = 16;

/// `Reach` of `client/compute/reach.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct ReachUniform {
    least_shift: [f32; 2],
    greatest_shift: [f32; 2],
    centre_px: [f32; 2],
    row: u32,
    padding: u32,
    levels: [[u32; 4]; LEVELS],
}

/// What receives, in the bindings of the shader.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    /// The view.
    pub(super) camera: &'a Buffer,
    /// From there to the frame.
    pub(super) in_frame: &'a Buffer,
    /// Inverse depths, and how many.
    pub(super) w: &'a wgpu::TextureView,
    pub(super) size_px: (u32, u32),
}

/// See the module.
#[derive(Debug)]
pub(super) struct ReachPass {
    gpu: Gpu,
    receive: wgpu::ComputePipeline,
    keep: wgpu::ComputePipeline,
    coarsen: wgpu::ComputePipeline,
    arrange: wgpu::ComputePipeline,
}

impl ReachPass {
    pub(super) fn new(gpu: &Gpu) -> Result<ReachPass, SurfaceError> {
        let module = gpu.shader("client/compute/reach.wgsl")?;
        let pipelines = ["receive", "keep", "coarsen", "arrange"];
        let [receive, keep, coarsen, arrange] = pipelines.map(|entry_point| gpu.compute_pipeline(&module, entry_point));
        Ok(ReachPass { gpu: gpu.clone(), receive, keep, coarsen, arrange })
    }

    /// Which of each list in the image of `frame` are within reach of `seen`, by points that shift by `shifts`: how many, and their places in the
    /// list.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        lists: &[Parallelograms],
        (frame, shifts): (&Pinhole, impl Iterator<Item = DVec2>),
        seen: Seen<'_>,
    ) -> Vec<Buffer> {
        let reach = ReachUniform::new(frame, shifts);
        let tiles: u32 = reach.levels().map(|level| level[0] * level[1]).sum();
        // They begin as zeros.
        let receivers = self.words("receivers", tiles);
        let reach_uniform = uniform(&self.gpu, "reach", bytemuck::bytes_of(&reach));
        let own = (0, reach_uniform.as_entire_binding());
        let tiles = (1, receivers.as_entire_binding());
        let camera = (4, seen.camera.as_entire_binding());
        let in_frame = (5, seen.in_frame.as_entire_binding());
        let w = (6, BindingResource::TextureView(seen.w));
        let groups = [seen.size_px.0.div_ceil(8), seen.size_px.1.div_ceil(8)];
        self.run(encoder, &self.receive, &[own.clone(), tiles.clone(), camera, in_frame, w], groups);
        for (level, [width, height, ..]) in reach.levels().enumerate().skip(1) {
            let level = uniform(&self.gpu, "level", bytemuck::bytes_of(&[level as u32, 0, 0, 0]));
            let inputs = [own.clone(), tiles.clone(), (7, level.as_entire_binding())];
            self.run(encoder, &self.coarsen, &inputs, [width.div_ceil(8), height.div_ceil(8)]);
        }
        let keep = |list: &Parallelograms| {
            let kept = self.words("kept", KEPT_HEADER_WORDS + list.count);
            let (all, some) = ((2, list.buffer.as_entire_binding()), (3, kept.as_entire_binding()));
            self.run(encoder, &self.keep, &[own.clone(), tiles.clone(), all, some.clone()], dispatch(list.count));
            self.run(encoder, &self.arrange, &[own.clone(), some], [1, 1]);
            kept
        };
        lists.iter().map(keep).collect()
    }

    fn words(&self, label: &str, count: u32) -> Buffer {
        let usage = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        let size = 4 * u64::from(count);
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        self.gpu.device.create_buffer(&descriptor)
    }

    fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        inputs: &[(u32, BindingResource<'_>)],
        groups: [u32; 2],
    ) {
        let inputs = inputs.iter().cloned();
        let entries: Vec<_> = inputs.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reach"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

impl ReachUniform {
    fn new(frame: &Pinhole, shifts: impl Iterator<Item = DVec2>) -> ReachUniform {
        let (least, greatest) = shifts.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(least, greatest), shift| {
            (least.min(shift), greatest.max(shift))
        });
        let mut uniform: ReachUniform = Zeroable::zeroed();
        uniform.least_shift = least.as_vec2().to_array();
        uniform.greatest_shift = greatest.as_vec2().to_array();
        uniform.centre_px = frame.centre_px.as_vec2().to_array();
        uniform.row = INVOCATIONS_A_ROW;
        let (mut width, mut height) = (frame.width_px.div_ceil(TILE_PX), frame.height_px.div_ceil(TILE_PX));
        let mut first = 0;
        for tiles in &mut uniform.levels {
            *tiles = [width, height, first, 0];
            first += width * height;
            if width.max(height) == 1 {
                break;
            }
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
        }
        uniform
    }

    fn levels(&self) -> impl Iterator<Item = [u32; 4]> {
        self.levels.into_iter().take_while(|level| level[0] > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(
            ReachUniform,
            "client/compute/reach.wgsl",
            "Reach",
            least_shift,
            greatest_shift,
            centre_px,
            row,
            levels
        );
    }

    #[test]
    fn levels_end_at_one_tile_and_lie_one_after_the_other() {
        let mut frame = Pinhole::symmetric(camera::Rigid::IDENTITY, (512, 37), 1.0, 0.1);
        for (width_px, height_px) in [(512, 37), (1, 1), (16_384, 3)] {
            (frame.width_px, frame.height_px) = (width_px, height_px);
            let reach = ReachUniform::new(&frame, [DVec2::X, -DVec2::Y].into_iter());
            let levels: Vec<_> = reach.levels().collect();
            assert_eq!(levels[0][..2], [width_px.div_ceil(4), height_px.div_ceil(4)]);
            assert_eq!(levels.last().expect("one")[..2], [1, 1]);
            for pair in levels.windows(2) {
                assert_eq!(pair[1][2], pair[0][2] + pair[0][0] * pair[0][1]);
            }
            assert_eq!((reach.least_shift, reach.greatest_shift), ([0.0, -1.0], [1.0, 0.0]));
        }
    }
}
