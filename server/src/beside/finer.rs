//! The finer images that tell where surfaces end, of what a comparison sends: drawn and read on the GPU.

use bytemuck::{Pod, Zeroable};
use gpu::Gpu;
use wgpu::util::DeviceExt;

use crate::discretize::Part;
use crate::render::buffer_entry;

/// `Part` of `server/beside/ends.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(super) struct PartUniform {
    first_px: [i32; 2],
    size_px: [u32; 2],
}

/// What the passes around a part's finer image bind beside what all do.
pub(super) struct PartInputs {
    uniform: wgpu::Buffer,
    /// By pixel of the part: the nearest depth that is drawn.
    pub nearest: wgpu::TextureView,
}

const NEAREST_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

impl PartInputs {
    pub fn new(gpu: &Gpu, part: Part) -> PartInputs {
        let ((x, y), (width, height)) = (part.first_with_margin(), part.size_with_margin());
        let uniform = PartUniform { first_px: [x, y], size_px: [width, height] };
        let nearest = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("nearest drawn"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: NEAREST_FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
            view_formats: &[],
        });
        PartInputs {
            uniform: gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("part"),
                contents: bytemuck::bytes_of(&uniform),
                usage: wgpu::BufferUsages::UNIFORM,
            }),
            nearest: nearest.create_view(&wgpu::TextureViewDescriptor::default()),
        }
    }

    /// What writes which depths are drawn.
    pub fn nearest_group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        group(gpu, layout, [(0, self.uniform.as_entire_binding()), (1, texture(&self.nearest))])
    }

    /// What reads the finer image: objects and depths.
    pub fn ends_group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout, finer: &[wgpu::Texture; 2]) -> wgpu::BindGroup {
        let [object, depth] =
            finer.each_ref().map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
        group(gpu, layout, [(0, self.uniform.as_entire_binding()), (2, texture(&object)), (3, texture(&depth))])
    }
}

fn texture(view: &wgpu::TextureView) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::TextureView(view)
}

fn group<const COUNT: usize>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: [(u32, wgpu::BindingResource<'_>); COUNT],
) -> wgpu::BindGroup {
    let entries = resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("part"), layout, entries: &entries })
}

/// Of [`PartInputs::nearest_group`], and of [`PartInputs::ends_group`].
pub(super) fn layouts(gpu: &Gpu) -> [wgpu::BindGroupLayout; 2] {
    let visibility = wgpu::ShaderStages::COMPUTE;
    let view_dimension = wgpu::TextureViewDimension::D2;
    let uniform = buffer_entry(0, visibility, wgpu::BufferBindingType::Uniform);
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let access = wgpu::StorageTextureAccess::WriteOnly;
    let nearest = entry(1, wgpu::BindingType::StorageTexture { access, format: NEAREST_FORMAT, view_dimension });
    let read = |binding, sample_type| {
        entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
    };
    let finer = [read(2, wgpu::TextureSampleType::Uint), read(3, wgpu::TextureSampleType::Depth)];
    let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
        gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("part"), entries })
    };
    [layout(&[uniform, nearest]), layout(&[uniform, finer[0], finer[1]])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(PartUniform, "server/beside/ends.wgsl", "Part", first_px, size_px);
    }
}
