//! Shadow maps of many of a lamp's points at once, without triangles: compute shaders scatter the rebuilt surfaces, as parallelograms
//! ([`surface::FlattenPass`]), into them.
//!
//! All points of a lamp look the same way from one plane that its images lie parallel to. So each sees a parallelogram as the frame does, but for
//! a shift that is linear in `w`: no matrices and no divisions, two multiply-adds a corner (3-D warping, McMillan and Bishop 1995, where both
//! images have one orientation). What is written into a texel is what [`super::maps`] draws there, up to what the quads' shared corners differ from
//! parallelograms; lookups are its own.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use surface::{FlattenPass, HeldSurfaces, Parallelograms, SurfaceError, dispatch};
use wgpu::BindingResource;

use super::{Count, Receivers};
use crate::fullscreen::{Binding, FullscreenPass, Onto, uniform};
use crate::shadow::{ROUNDING, from_view};

/// Points whose maps are drawn together at most; the twin of the constant in `client/compute/warp_points.wgsl`.
const POINTS: usize = 32;
/// The maps of a batch take no more bytes than this: as many as most caches hold.
const BATCH_BYTES: u64 = 16 << 20;

/// `WarpPoints` of `client/compute/warp_points.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct PointsUniform {
    size_px: [u32; 2],
    count: u32,
    row: u32,
    point_count: u32,
    padding: [u32; 3],
    places: [[f32; 4]; POINTS],
    weights: [[f32; 4]; POINTS],
}

/// `Frame` of `client/compute/warp_lookup.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct FrameUniform {
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
    warp: wgpu::ComputePipeline,
    lookup: FullscreenPass,
    maps: Option<wgpu::Buffer>,
}

impl PointWarps {
    pub(super) fn new(gpu: &Gpu) -> Result<PointWarps, SurfaceError> {
        use Binding::{FloatTexture, Storage, UintTexture, Uniform};
        let module = gpu.shader("client/compute/warp.wgsl")?;
        let warp = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("warp"),
            layout: None,
            module: &module,
            entry_point: Some("warp"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let bindings = [Uniform, Uniform, Uniform, Uniform, FloatTexture, UintTexture, Storage];
        let shader = ("client/compute/warp_lookup.wgsl", "hidden_by_maps");
        let lookup = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[super::SoftShadows::FORMAT])?;
        Ok(PointWarps { gpu: gpu.clone(), flatten: FlattenPass::new(gpu)?, warp, lookup, maps: None })
    }

    /// Whether the views of a face only differ by shifts: whether their eyes lie in a plane parallel to their images.
    pub(super) fn may_warp(face: &[Pinhole]) -> bool {
        let Some(first) = face.first() else { return false };
        let frame_from_world = first.world_from_eye.inverse();
        let away = |view: &Pinhole| frame_from_world.transform_point(view.world_from_eye.translation);
        // A millionth of how far the eyes lie apart moves what is as near as they are by less than a thousandth of a texel.
        face.iter().all(|view| away(view).z.abs() <= 1e-6 * away(view).length())
    }

    /// Whether the device takes a list of all that casts.
    pub(super) fn has_room_for(&self, casters: &HeldSurfaces) -> bool {
        Parallelograms::bytes(casters.stats().samples) <= self.gpu.device.limits().max_storage_buffer_binding_size
    }

    /// Counts the points of a face, the first of which is number 0.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (face, casters): (&[Pinhole], &HeldSurfaces),
        receivers: Receivers<'_>,
        count: Count<'_>,
    ) {
        let frame = &face[0];
        let Some(list) = self.flatten.encode(encoder, casters, frame) else { return };
        let texels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let batch = (BATCH_BYTES / (4 * texels)).clamp(1, POINTS as u64) as usize;
        let bytes = 4 * texels * batch as u64;
        let maps = self.maps.take().filter(|maps| maps.size() == bytes).unwrap_or_else(|| {
            self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("point maps"),
                size: bytes,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let groups = dispatch(list.count);
        let eye_world = receivers.view.world_from_eye.translation;
        let camera = PinholeUniform::new(receivers.view, eye_world);
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&camera));
        let materials = MaterialUniform::table(&receivers.held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let in_frame = uniform(&self.gpu, "frame", bytemuck::bytes_of(&FrameUniform::new(frame, receivers.view)));
        let mut first = 0;
        while first < face.len() {
            // Points that count in one target.
            let room = Count::POINTS_A_TARGET - first % Count::POINTS_A_TARGET;
            let some = &face[first..(first + batch.min(room)).min(face.len())];
            let (hidden, _) = count.of(first, face.len());
            let weights = |index: usize| count.of(first + index, face.len()).1;
            let points = PointsUniform::new(frame, some, (list.count, groups[0] * 64), weights);
            let points = uniform(&self.gpu, "points", bytemuck::bytes_of(&points));
            encoder.clear_buffer(&maps, 0, Some(4 * texels * some.len() as u64));
            self.warp(encoder, &points, &list.buffer, &maps, groups);
            let views = &receivers.gbuffer.views;
            let inputs = [
                camera.as_entire_binding(),
                materials.as_entire_binding(),
                in_frame.as_entire_binding(),
                points.as_entire_binding(),
                BindingResource::TextureView(&views.w),
                BindingResource::TextureView(&views.normal_ids),
                maps.as_entire_binding(),
            ];
            self.lookup.encode(encoder, &inputs, &[hidden]);
            first += some.len();
        }
        self.maps = Some(maps);
    }

    fn warp(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        points: &wgpu::Buffer,
        list: &wgpu::Buffer,
        maps: &wgpu::Buffer,
        groups: [u32; 2],
    ) {
        let resources = [points, list, maps].map(|buffer| buffer.as_entire_binding());
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("warp"),
            layout: &self.warp.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.warp);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

impl PointsUniform {
    fn new(
        frame: &Pinhole,
        points: &[Pinhole],
        (count, row): (u32, u32),
        weights: impl Fn(usize) -> [f32; 4],
    ) -> PointsUniform {
        let frame_from_world = frame.world_from_eye.inverse();
        let mut uniform: PointsUniform = Zeroable::zeroed();
        uniform.size_px = [frame.width_px, frame.height_px];
        (uniform.count, uniform.row) = (count, row);
        uniform.point_count = points.len() as u32;
        for (index, point) in points.iter().enumerate() {
            let shift = frame_from_world.transform_point(point.world_from_eye.translation).truncate() * frame.focal_px;
            uniform.places[index] = [shift.x, shift.y, point.centre_px.x, point.centre_px.y].map(|value| value as f32);
            uniform.weights[index] = weights(index);
        }
        uniform
    }
}

impl FrameUniform {
    fn new(frame: &Pinhole, view: &Pinhole) -> FrameUniform {
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
        shaders::assert_layout!(PointsUniform, path, "WarpPoints", size_px, count, row, point_count, places, weights);
        shaders::assert_layout!(FrameUniform, path, "Frame", frame_from_view, focal_px, near_m, rounding);
    }
}
