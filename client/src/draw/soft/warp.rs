//! Shadow maps of many of a lamp's points at once, without triangles: compute shaders scatter the rebuilt surfaces, as parallelograms
//! ([`surface::FlattenPass`]), into them.
//!
//! All points of a lamp look the same way from one plane that its images lie parallel to. So each sees a parallelogram as the frame does, but for
//! a shift that is linear in `w`: no matrices and no divisions, two multiply-adds a corner (3-D warping, McMillan and Bishop 1995, where both
//! images have one orientation). What is written into a texel is what [`super::maps`] draws there, up to what the quads' shared corners differ from
//! parallelograms; lookups are its own.

use camera::Pinhole;
use gpu::Gpu;
use surface::{FlattenPass, HeldSurfaces, SurfaceError};
use wgpu::BindingResource;

use super::batch::{POINTS, PointsUniform, Ready, batches, shifts};
use super::bias::Bias;
use super::count::Count;
use super::reach::{DISPATCHES, ReachPass, Seen};
use super::receivers::Receivers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Onto};

/// The maps of a batch take no more bytes than this: each batch reads everything that casts, so few are better than what a cache holds (on two
/// cores 14 maps of 512 by 512 texels at once take 1.4 times as long as 28, and more gain nothing).
const BATCH_BYTES: u64 = 32 << 20;

/// See the module. Needs [`gpu::Caps::compute`].
#[derive(Debug)]
pub(super) struct PointWarps {
    gpu: Gpu,
    bias: Bias,
    flatten: FlattenPass,
    reach: ReachPass,
    warps: [wgpu::ComputePipeline; 2],
    lookup: FullscreenPass,
    maps: Option<Maps>,
}

/// The maps of a batch: written into a buffer, read from the layers of a texture, which is faster wherever textures are.
#[derive(Debug)]
struct Maps {
    size_px: [u32; 2],
    /// Texels from a row to the next in the buffer.
    pitch: u32,
    buffer: wgpu::Buffer,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl Maps {
    fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Maps {
        let pitch = width.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4);
        let bytes = 4 * u64::from(pitch) * u64::from(height);
        let layers = (BATCH_BYTES / bytes).clamp(1, POINTS as u64) as u32;
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("point maps"),
            size: bytes * u64::from(layers),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("point maps"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let view = texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
        Maps { size_px: [width, height], pitch, buffer, texture, view }
    }

    fn layers(&self) -> usize {
        self.texture.depth_or_array_layers() as usize
    }

    /// Nothing casts in the first of them.
    fn clear(&self, encoder: &mut wgpu::CommandEncoder, layers: usize) {
        let bytes = self.buffer.size() / self.layers() as u64 * layers as u64;
        encoder.clear_buffer(&self.buffer, 0, Some(bytes));
    }

    /// Takes what was written over into the texture.
    fn copy(&self, encoder: &mut wgpu::CommandEncoder, layers: usize) {
        let [width, height] = self.size_px;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * self.pitch),
            rows_per_image: Some(height),
        };
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout },
            self.texture.as_image_copy(),
            wgpu::Extent3d { width, height, depth_or_array_layers: layers as u32 },
        );
    }
}

impl PointWarps {
    pub(super) fn new(gpu: &Gpu, bias: Bias) -> Result<PointWarps, SurfaceError> {
        let module = gpu.shader("client/compute/warp.wgsl")?;
        let warps = ["warp_small", "warp_large"].map(|entry_point| gpu.compute_pipeline(&module, entry_point));
        let bindings = [&Ready::BINDINGS[..], &[Binding::FloatTextures]].concat();
        let shader = ("client/compute/warp_lookup.wgsl", "hidden_by_maps");
        let lookup = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[Count::FORMAT])?;
        let (flatten, reach) = (FlattenPass::new(gpu)?, ReachPass::new(gpu)?);
        Ok(PointWarps { gpu: gpu.clone(), bias, flatten, reach, warps, lookup, maps: None })
    }

    /// Whether the views of a face only differ by shifts: whether their eyes lie in a plane parallel to their images.
    pub(super) fn may_warp(face: &[Pinhole]) -> bool {
        let Some(first) = face.first() else { return false };
        let frame_from_world = first.world_from_eye.inverse();
        let away = |view: &Pinhole| frame_from_world.transform_point(view.world_from_eye.translation);
        // A millionth of how far the eyes lie apart moves what is as near as they are by less than a thousandth of a texel.
        face.iter().all(|view| away(view).z.abs() <= 1e-6 * away(view).length())
    }

    /// Whether the device takes all that casts.
    pub(super) fn has_room_for(&self, casters: &HeldSurfaces) -> bool {
        self.flatten.may_encode(casters)
    }

    /// Counts some of the points of a face.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (face, casters): (&[Pinhole], &HeldSurfaces),
        receivers: Receivers<'_>,
        (count, numbers): (Count<'_>, &[usize]),
    ) {
        let frame = &face[0];
        let lists = self.flatten.encode(encoder, casters, frame);
        if lists.is_empty() {
            return;
        }
        let maps = match self.maps.take() {
            Some(maps) if maps.size_px == [frame.width_px, frame.height_px] => maps,
            _ => Maps::new(&self.gpu, [frame.width_px, frame.height_px]),
        };
        let ready = Ready::new(&self.gpu, (frame, self.bias), receivers);
        let seen = Seen {
            camera: &ready.camera,
            in_frame: &ready.in_frame,
            w: &receivers.gbuffer.views.w,
            size_px: receivers.gbuffer.size_px,
        };
        let kept = self.reach.encode(encoder, &lists, (frame, shifts(frame, face)), seen);
        for numbers in batches(numbers, maps.layers(), count) {
            let (hidden, _) = count.of(numbers[0], face.len());
            let points = ready.points(&PointsUniform::new(frame, (face, numbers), maps.pitch, count));
            maps.clear(encoder, numbers.len());
            for (list, kept) in lists.iter().zip(&kept) {
                self.warp(encoder, [&points, &list.buffer, &maps.buffer, kept]);
            }
            maps.copy(encoder, numbers.len());
            let maps = BindingResource::TextureView(&maps.view);
            let inputs: Vec<_> = ready.inputs(&points).into_iter().chain([maps]).collect();
            self.lookup.encode(encoder, &inputs, &[hidden]);
        }
        self.maps = Some(maps);
    }

    /// Writes small parallelograms, then large ones.
    fn warp(&self, encoder: &mut wgpu::CommandEncoder, inputs: [&wgpu::Buffer; 4]) {
        let resources = inputs.map(|buffer| buffer.as_entire_binding());
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for (pipeline, groups) in self.warps.iter().zip(DISPATCHES) {
            let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("warp"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups_indirect(inputs[3], groups);
        }
    }
}
