//! Shadow maps of many of a lamp's points at once, without triangles: compute shaders scatter the rebuilt surfaces, as parallelograms
//! ([`surface::FlattenPass`]), into them.
//!
//! All points of a lamp look the same way from one plane that its images lie parallel to. So each sees a parallelogram as the frame does, but for
//! a shift that is linear in `w`: no matrices and no divisions, two multiply-adds a corner (3-D warping, McMillan and Bishop 1995, where both
//! images have one orientation). What is written into a texel is what [`super::maps`] draws there, up to what the quads' shared corners differ from
//! parallelograms; lookups are its own.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::DVec2;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use surface::{FlattenPass, HeldSurfaces, INVOCATIONS_A_ROW, SurfaceError};
use wgpu::BindingResource;

use super::reach::{DISPATCHES, ReachPass, Seen};
use super::{Count, Receivers};
use crate::fullscreen::{Binding, FullscreenPass, Onto, uniform};
use crate::shadow::{ROUNDING, from_view};

/// Points whose maps are drawn together at most; the twin of the constant in `client/compute/warp_points.wgsl`.
pub(super) const POINTS: usize = 32;
/// The maps of a batch take no more bytes than this: each batch reads everything that casts, so few are better than what a cache holds (on two
/// cores 14 maps of 512 by 512 texels at once take 1.4 times as long as 31, and more gain nothing).
const BATCH_BYTES: u64 = 32 << 20;

/// `WarpPoints` of `client/compute/warp_points.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct PointsUniform {
    size_px: [u32; 2],
    pitch: u32,
    row: u32,
    point_count: u32,
    padding: [u32; 3],
    places: [[f32; 4]; POINTS],
    weights: [[f32; 4]; POINTS],
}

/// `Frame` of `client/compute/warp_lookup.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct FrameUniform {
    frame_from_view: [[f32; 4]; 4],
    focal_px: f32,
    near_m: f32,
    rounding: f32,
    padding: f32,
}

/// See the module. Needs [`gpu::Caps::compute`].
#[derive(Debug)]
pub(super) struct PointWarps {
    gpu: Gpu,
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
    pub(super) fn new(gpu: &Gpu) -> Result<PointWarps, SurfaceError> {
        use Binding::{FloatTexture, FloatTextures, UintTexture, Uniform};
        let module = gpu.shader("client/compute/warp.wgsl")?;
        let warps = ["warp_small", "warp_large"].map(|entry_point| gpu.compute_pipeline(&module, entry_point));
        let bindings = [Uniform, Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTextures];
        let shader = ("client/compute/warp_lookup.wgsl", "hidden_by_maps");
        let lookup = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[super::SoftShadows::FORMAT])?;
        let (flatten, reach) = (FlattenPass::new(gpu)?, ReachPass::new(gpu)?);
        Ok(PointWarps { gpu: gpu.clone(), flatten, reach, warps, lookup, maps: None })
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
        let eye_world = receivers.view.world_from_eye.translation;
        let camera = PinholeUniform::new(receivers.view, eye_world);
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&camera));
        let materials = MaterialUniform::table(&receivers.held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let in_frame = uniform(&self.gpu, "frame", bytemuck::bytes_of(&FrameUniform::new(frame, receivers.view)));
        let seen = Seen {
            camera: &camera,
            in_frame: &in_frame,
            w: &receivers.gbuffer.views.w,
            size_px: receivers.gbuffer.size_px,
        };
        let kept = self.reach.encode(encoder, &lists, (frame, shifts(frame, face)), seen);
        for numbers in numbers
            .chunk_by(|a, b| count.target_of(*a) == count.target_of(*b))
            .flat_map(|numbers| numbers.chunks(maps.layers()))
        {
            let (hidden, _) = count.of(numbers[0], face.len());
            let points = PointsUniform::new(frame, (face, numbers), maps.pitch, count);
            let points = uniform(&self.gpu, "points", bytemuck::bytes_of(&points));
            maps.clear(encoder, numbers.len());
            for (list, kept) in lists.iter().zip(&kept) {
                self.warp(encoder, [&points, &list.buffer, &maps.buffer, kept]);
            }
            maps.copy(encoder, numbers.len());
            let views = &receivers.gbuffer.views;
            let inputs = [
                camera.as_entire_binding(),
                materials.as_entire_binding(),
                in_frame.as_entire_binding(),
                points.as_entire_binding(),
                BindingResource::TextureView(&views.w),
                BindingResource::TextureView(&views.normal_ids),
                BindingResource::TextureView(&maps.view),
            ];
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

/// What each of some points shifts by at `w = 1`, in pixels of the frame's image.
pub(super) fn shifts(frame: &Pinhole, points: &[Pinhole]) -> impl Iterator<Item = DVec2> {
    let frame_from_world = frame.world_from_eye.inverse();
    let place = move |point: &Pinhole| frame_from_world.transform_point(point.world_from_eye.translation);
    points.iter().map(move |point| place(point).truncate() * frame.focal_px)
}

impl PointsUniform {
    /// Of the points of a face with these numbers, for maps with rows of `pitch` texels.
    pub(super) fn new(
        frame: &Pinhole,
        (face, numbers): (&[Pinhole], &[usize]),
        pitch: u32,
        count: Count<'_>,
    ) -> PointsUniform {
        let mut uniform: PointsUniform = Zeroable::zeroed();
        uniform.size_px = [frame.width_px, frame.height_px];
        (uniform.pitch, uniform.row) = (pitch, INVOCATIONS_A_ROW);
        uniform.point_count = numbers.len() as u32;
        let points: Vec<Pinhole> = numbers.iter().map(|number| face[*number]).collect();
        for (index, (point, shift)) in points.iter().zip(shifts(frame, &points)).enumerate() {
            uniform.places[index] = [shift.x, shift.y, point.centre_px.x, point.centre_px.y].map(|value| value as f32);
            (_, uniform.weights[index]) = count.of(numbers[index], face.len());
        }
        uniform
    }
}

impl FrameUniform {
    pub(super) fn new(frame: &Pinhole, view: &Pinhole) -> FrameUniform {
        FrameUniform {
            frame_from_view: from_view(frame, view.world_from_eye.translation),
            focal_px: frame.focal_px as f32,
            near_m: frame.near_m as f32,
            rounding: ROUNDING as f32,
            padding: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "client/compute/warp_lookup.wgsl";
        shaders::assert_layout!(PointsUniform, path, "WarpPoints", size_px, pitch, row, point_count, places, weights);
        shaders::assert_layout!(FrameUniform, path, "Frame", frame_from_view, focal_px, near_m, rounding);
    }
}
