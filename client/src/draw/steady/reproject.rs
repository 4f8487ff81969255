//! Shows a picture as it looks from another eye, for the time until there is a new one.
//!
//! The picture is a net of cells, whose corners lie at the depths that it has there, drawn with a depth test (a depth image drawn as a mesh: Mark, McMillan,
//! Bishop, *Post-rendering 3D warping*, 1997). Where a near surface moves off a far one the net is stretched between both. What the picture does not hold is
//! as its border.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use gpu::uniforms::{Rows, rows};
use shaders::ShaderError;
use surface::GBuffer;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, ShaderStages, TextureFormat, TextureView};

use crate::draw::fullscreen::{Binding, Target, bind, layout, uniform};

/// Pixels of the picture along a cell's side: finer ones take longer to draw than what they show of outlines is worth.
const CELL_PX: u32 = 8;

/// `Reproject` of `client/reproject.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct ReprojectUniform {
    eye_from_picture: Rows,
    centre_px: [f32; 2],
    size_px: [f32; 2],
    focal_px: f32,
    near_m: f32,
    cell_px: f32,
    columns: u32,
    clip_scale: [f32; 2],
    clip_shift: [f32; 2],
    corners: u32,
    padding: [u32; 3],
}

/// A picture, and what it was taken by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    pub camera: &'a Pinhole,
    pub colour: &'a TextureView,
    /// In 1/m, 0 where there is no surface.
    pub w: &'a TextureView,
}

/// See the module.
#[derive(Debug)]
pub(super) struct ReprojectPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    /// Of pictures of the last size.
    net: Option<Net>,
    depth: Option<Target>,
}

/// The triangles of the cells.
#[derive(Debug)]
struct Net {
    columns: u32,
    rows: u32,
    indices: wgpu::Buffer,
    count: u32,
}

impl Net {
    fn new(gpu: &Gpu, (columns, rows): (u32, u32)) -> Net {
        let mut corners: Vec<u32> = Vec::with_capacity(6 * ((columns - 1) * (rows - 1)) as usize);
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let first = row * columns + column;
                let below = first + columns;
                corners.extend([first, below, first + 1, first + 1, below, below + 1]);
            }
        }
        // Infinitely far away the picture is flat, so its border is all of it.
        let [across, down] = [columns, rows].map(|count| [0, 1, count - 2, count - 1]);
        for (above, below) in down.into_iter().zip(down.into_iter().skip(1)) {
            for (left, right) in across.into_iter().zip(across.into_iter().skip(1)) {
                let corner = |row: u32, column: u32| columns * rows + row * columns + column;
                let (a, b, c, d) =
                    (corner(above, left), corner(above, right), corner(below, left), corner(below, right));
                corners.extend([a, c, b, b, c, d]);
            }
        }
        let count = corners.len() as u32;
        let indices = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("cells"),
            contents: bytemuck::cast_slice(&corners),
            usage: wgpu::BufferUsages::INDEX,
        });
        Net { columns, rows, indices, count }
    }

    /// Corners along each side of a picture: of its cells, and one further out on both ends.
    fn corners((width_px, height_px): (u32, u32)) -> (u32, u32) {
        (width_px.div_ceil(CELL_PX) + 3, height_px.div_ceil(CELL_PX) + 3)
    }
}

impl ReprojectPass {
    /// Onto targets of `format`.
    pub(super) fn new(gpu: &Gpu, format: TextureFormat) -> Result<ReprojectPass, ShaderError> {
        let bindings = [Binding::Uniform, Binding::SampledTexture, Binding::FloatTexture, Binding::Sampler];
        let layout = layout(gpu, "reproject", ShaderStages::VERTEX_FRAGMENT, &bindings);
        let module = gpu.shader("client/reproject.wgsl")?;
        let pipeline = pipeline(gpu, &module, &layout, format);
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("key picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(ReprojectPass { gpu: gpu.clone(), layout, pipeline, sampler, net: None, depth: None })
    }

    /// Shows a picture as `camera` sees it, whose size is the output's.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        seen: Seen<'_>,
        camera: &Pinhole,
        output: &TextureView,
    ) {
        let corners = Net::corners((seen.camera.width_px, seen.camera.height_px));
        let net = self.net.take().filter(|net| (net.columns, net.rows) == corners);
        let net = net.unwrap_or_else(|| Net::new(&self.gpu, corners));
        let size_px = (camera.width_px, camera.height_px);
        let depth = self.depth.take().filter(|depth| (depth.texture.width(), depth.texture.height()) == size_px);
        let depth = depth.unwrap_or_else(|| Target::new(&self.gpu, "reprojected depth", size_px, GBuffer::DEPTH));
        let view = uniform(&self.gpu, "reproject", bytemuck::bytes_of(&uniform_of(seen.camera, camera, corners)));
        let inputs = [
            view.as_entire_binding(),
            BindingResource::TextureView(seen.colour),
            BindingResource::TextureView(seen.w),
            BindingResource::Sampler(&self.sampler),
        ];
        let mut pass = crate::draw::fullscreen::begin(encoder, "reproject", true, &[output], Some(&depth.view));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bind(&self.gpu, "reproject", &self.layout, &inputs), &[]);
        pass.set_index_buffer(net.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..net.count, 0, 0..1);
        drop(pass);
        (self.net, self.depth) = (Some(net), Some(depth));
    }
}

fn uniform_of(picture: &Pinhole, output: &Pinhole, corners: (u32, u32)) -> ReprojectUniform {
    // Composed in f64: far from the origin both are large, and their difference is not.
    let eye_from_picture = output.world_from_eye.inverse().to_affine() * picture.world_from_eye.to_affine();
    let clip_from_eye = output.clip_from_eye();
    ReprojectUniform {
        eye_from_picture: rows(eye_from_picture),
        centre_px: picture.centre_px.as_vec2().to_array(),
        size_px: [picture.width_px as f32, picture.height_px as f32],
        focal_px: picture.focal_px as f32,
        near_m: output.near_m as f32,
        cell_px: CELL_PX as f32,
        columns: corners.0,
        clip_scale: [clip_from_eye.x_axis.x, clip_from_eye.y_axis.y],
        clip_shift: [clip_from_eye.z_axis.x, clip_from_eye.z_axis.y],
        corners: corners.0 * corners.1,
        padding: [0; 3],
    }
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    format: TextureFormat,
) -> wgpu::RenderPipeline {
    let device = &gpu.device;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("reproject"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("reproject"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: GBuffer::DEPTH,
            depth_write_enabled: Some(true),
            // What has no surface is infinitely far, where targets are cleared to.
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState::from(format))],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_is_laid_out_as_the_shader_has_it() {
        shaders::assert_layout!(
            ReprojectUniform,
            "client/reproject.wgsl",
            "Reproject",
            eye_from_picture,
            centre_px,
            size_px,
            focal_px,
            near_m,
            cell_px,
            columns,
            clip_scale,
            clip_shift,
            corners
        );
    }
}
