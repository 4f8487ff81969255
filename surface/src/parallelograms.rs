//! Everything held as one list of small parallelograms in the image of a frame, for compute shaders that draw it many times over.
//!
//! Of each sample's quad the middle and the two mean half sides are kept, in `(u, v, w)` of the frame: a plane there, as planes are linear in
//! `w`. An eye that looks the same way as the frame from a place beside it sees all of them shifted by what is linear in `w`
//! ([`camera::parallel_views`]), so the same list serves all of a lamp's points. What its quads share at corners is lost by up to what their
//! planes differ.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use gpu::uniforms::Rows;
use wgpu::util::DeviceExt;

use crate::SurfaceError;
use crate::held::HeldSurfaces;
use crate::mesh::QUAD_INDICES;
use crate::pass::setback;
use crate::patch::{PatchSurface, QuadBuffers};
use crate::placement::{Placement, movers_texture};

/// `Patch` of `surface/parallelograms.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct PatchUniform {
    frame_from_patch: Rows,
    centre_px: [f32; 2],
    focal_px: f32,
    first_mover: u32,
    frame_focal_px: f32,
    setback: f32,
    first_quad: u32,
    quad_count: u32,
    first: u32,
    row: u32,
    padding: [u32; 2],
}

/// Invocations of a workgroup of compute shaders over lists.
const GROUP: u32 = 64;
/// Workgroups in a row of a dispatch: any device allows as many.
const GROUPS_A_ROW: u32 = 1024;
/// Invocations in a row of a dispatch that has more than one.
pub const INVOCATIONS_A_ROW: u32 = GROUP * GROUPS_A_ROW;

/// A list, as an array of `Parallelogram` (`surface/parallelogram.wgsl`).
#[derive(Debug)]
pub struct Parallelograms {
    /// 48 bytes each.
    pub buffer: wgpu::Buffer,
    /// How many; some may be empty.
    pub count: u32,
}

/// What one of a list takes.
const BYTES: u64 = 48;

/// Quads of a patch that go into one list: the patch's number, its first, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    patch: usize,
    first: u32,
    count: u32,
}

/// Quads of patches in as few lists of at most `most` as hold them, in order.
fn lists(quads: impl Iterator<Item = u32>, most: u32) -> Vec<Vec<Part>> {
    let (mut lists, mut room) = (Vec::<Vec<Part>>::new(), 0);
    for (patch, count) in quads.enumerate() {
        let mut first = 0;
        while first < count {
            if room == 0 {
                lists.push(Vec::new());
                room = most.max(1);
            }
            let part = Part { patch, first, count: room.min(count - first) };
            (first, room) = (first + part.count, room - part.count);
            lists.last_mut().expect("one was begun").push(part);
        }
    }
    lists
}

/// Makes lists. Needs [`gpu::Caps::compute`].
#[derive(Debug)]
pub struct FlattenPass {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
}

impl FlattenPass {
    /// Compiles the pipeline.
    pub fn new(gpu: &Gpu) -> Result<FlattenPass, SurfaceError> {
        let module = gpu.shader("surface/parallelograms.wgsl")?;
        let pipeline = gpu.compute_pipeline(&module, "flatten");
        Ok(FlattenPass { gpu: gpu.clone(), pipeline })
    }

    /// Whether the device takes every patch; one of 2.8 million samples is too large for the least of devices.
    pub fn may_encode(&self, surfaces: &HeldSurfaces) -> bool {
        let most = self.gpu.device.limits().max_storage_buffer_binding_size;
        surfaces.patches().all(|(_, patch)| match &patch.quads {
            QuadBuffers::Gpu { vertices, indices, .. } => vertices.size().max(indices.size()) <= most,
            QuadBuffers::Host { .. } => true,
        })
    }

    /// Everything held on the GPU, in the image of `frame`: as many lists as it takes by what a device binds at once, none where nothing is held.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        frame: &Pinhole,
    ) -> Vec<Parallelograms> {
        let most = u32::try_from(self.gpu.device.limits().max_storage_buffer_binding_size / BYTES).unwrap_or(u32::MAX);
        let quads = surfaces.patches().map(|(_, patch)| quads(patch));
        lists(quads, most).iter().map(|parts| self.list(encoder, surfaces, (frame, parts))).collect()
    }

    fn list(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        (frame, parts): (&Pinhole, &[Part]),
    ) -> Parallelograms {
        let device = &self.gpu.device;
        let count = parts.iter().map(|part| part.count).sum();
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("parallelograms"),
            size: BYTES * u64::from(count),
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let patches: Vec<&PatchSurface> = surfaces.patches().map(|(_, patch)| patch).collect();
        let patch_of = |part: &Part| patches[part.patch];
        let frame_from_world = frame.world_from_eye.inverse().to_affine();
        let placements: Vec<Placement> =
            parts.iter().map(|part| Placement::new(surfaces, patch_of(part), &frame_from_world)).collect();
        let movers = placements.iter().flat_map(|placement| &placement.movers);
        let texels = movers.flat_map(|mover| mover.eye_from_patch.into_iter().chain(mover.turn)).collect();
        let movers = movers_texture(&self.gpu, texels).create_view(&wgpu::TextureViewDescriptor::default());
        let (mut first, mut first_mover) = (0, 0);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        for (part, placement) in parts.iter().zip(&placements) {
            let patch = patch_of(part);
            let QuadBuffers::Gpu { vertices, indices, .. } = &patch.quads else { continue };
            let groups = dispatch(part.count);
            let uniform = PatchUniform {
                frame_from_patch: placement.eye_from_patch,
                centre_px: patch.camera.centre_px.as_vec2().to_array(),
                focal_px: patch.camera.focal_px as f32,
                first_mover,
                frame_focal_px: frame.focal_px as f32,
                setback: setback(patch, None),
                first_quad: part.first,
                quad_count: part.count,
                first,
                row: INVOCATIONS_A_ROW,
                padding: [0; 2],
            };
            first += part.count;
            first_mover += placement.movers.len() as u32;
            let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("patch"),
                contents: bytemuck::bytes_of(&uniform),
                usage: wgpu::BufferUsages::UNIFORM,
            });
            let resources = [
                uniform.as_entire_binding(),
                vertices.as_entire_binding(),
                indices.as_entire_binding(),
                buffer.as_entire_binding(),
                wgpu::BindingResource::TextureView(&movers),
            ];
            let entries: Vec<_> =
                (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("flatten"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        drop(pass);
        Parallelograms { buffer, count }
    }
}

fn quads(patch: &PatchSurface) -> u32 {
    match &patch.quads {
        QuadBuffers::Gpu { index_count, .. } => index_count / QUAD_INDICES as u32,
        QuadBuffers::Host { .. } => 0,
    }
}

/// Workgroups of 64 in rows and columns for so many invocations: no more in a row than any device allows.
pub fn dispatch(count: u32) -> [u32; 2] {
    let groups = count.div_ceil(GROUP);
    [groups.min(GROUPS_A_ROW), groups.div_ceil(GROUPS_A_ROW)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_all_quads_in_order_and_no_more_than_may_be() {
        let part = |patch, first, count| Part { patch, first, count };
        assert_eq!(lists([3, 0, 2].into_iter(), 9), [[part(0, 0, 3), part(2, 0, 2)]]);
        assert_eq!(lists([3, 2].into_iter(), 3), [[part(0, 0, 3)], [part(1, 0, 2)]]);
        let cut = lists([1, 5].into_iter(), 2);
        assert_eq!(cut, [vec![part(0, 0, 1), part(1, 0, 1)], vec![part(1, 1, 2)], vec![part(1, 3, 2)]]);
        assert!(lists([0, 0].into_iter(), 4).is_empty());
    }

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "surface/parallelograms.wgsl";
        shaders::assert_layout!(
            PatchUniform,
            path,
            "Patch",
            frame_from_patch,
            centre_px,
            focal_px,
            first_mover,
            frame_focal_px,
            setback,
            first_quad,
            quad_count,
            first,
            row
        );
    }
}
