//! The pass: one draw an object.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DAffine3, Vec3};
use gpu::uniforms::{Rows, rows};
use gpu::{Gpu, PinholeUniform};
use protocol::body::BoneRows;
use protocol::{Body, Held};
use shaders::ShaderError;
use surface::GBuffer;
use wgpu::{BindingResource, ShaderStages};

use super::placed::{BodyVertex, Placed};
use super::store::{Bodies, world_from_object};
use crate::draw::fullscreen::{Binding, bind, layout, uniform};
use crate::draw::relief::{may_show, onto};

const BINDINGS: [Binding; 5] =
    [Binding::Uniform, Binding::Uniform, Binding::Uniform, Binding::SampledTexture, Binding::Sampler];

/// `Body` of `client/body.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct BodyUniform {
    eye_from_body: Rows,
    world_normal_from_body: Rows,
    least: [f32; 4],
    size: [f32; 4],
    least_size_uv: [f32; 4],
    tint: [f32; 4],
    object: u32,
    material: u32,
    bone_count: u32,
    cut_out: u32,
    is_flat: u32,
    padding: [u32; 3],
}

/// What is drawn, and from where.
pub(crate) struct BodyInputs<'a> {
    pub bodies: &'a Bodies,
    pub held: &'a Held,
    pub poses_now: &'a BTreeMap<u16, DAffine3>,
    pub camera: &'a Pinhole,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct BodyPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    /// Of what has one side, and of what has two.
    pipelines: [wgpu::RenderPipeline; 2],
}

impl BodyPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<BodyPass, ShaderError> {
        let module = gpu.shader("client/body.wgsl")?;
        let layout = layout(gpu, "bodies", ShaderStages::VERTEX_FRAGMENT, &BINDINGS);
        let pipelines = [Some(wgpu::Face::Back), None].map(|culled| pipeline(gpu, &module, &layout, culled));
        Ok(BodyPass { gpu: gpu.clone(), layout, pipelines })
    }

    /// Draws all objects that bodies show into `target`, which holds surfaces of the same view.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, inputs: &BodyInputs<'_>, target: &GBuffer) {
        let BodyInputs { bodies, held, poses_now, camera } = *inputs;
        let view = PinholeUniform::new(camera, camera.world_from_eye.translation);
        let view = uniform(&self.gpu, "view", bytemuck::bytes_of(&view));
        let shown = bodies.shown(held).filter_map(|(object, placed, instance)| {
            let world_from_body = world_from_object(placed, (object, instance), poses_now);
            Some((placed, body_uniform(placed, camera, (object, instance.tint), &world_from_body)?))
        });
        let shown: Vec<(&Placed, BodyUniform)> = shown.collect();
        if shown.is_empty() {
            return;
        }
        let mut pass = onto(encoder, target, "bodies");
        for (placed, body) in shown {
            let body = uniform(&self.gpu, "body", bytemuck::bytes_of(&body));
            let bones = uniform(&self.gpu, "bones", bytemuck::cast_slice(&bone_rows(&bodies.bones(placed))));
            let inputs = [
                view.as_entire_binding(),
                body.as_entire_binding(),
                bones.as_entire_binding(),
                BindingResource::TextureView(&placed.colours),
                BindingResource::Sampler(&placed.sampler),
            ];
            pass.set_pipeline(&self.pipelines[usize::from(placed.body.double_sided)]);
            pass.set_bind_group(0, &bind(&self.gpu, "body", &self.layout, &inputs), &[]);
            pass.set_vertex_buffer(0, placed.vertices.slice(..));
            pass.set_index_buffer(placed.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..placed.body.indices.len() as u32, 0, 0..1);
        }
    }
}

/// Three rows a bone, with room for the most.
fn bone_rows(bones: &[BoneRows]) -> Vec<[f32; 4]> {
    let mut rows = bones.as_flattened().to_vec();
    rows.resize(3 * Body::MOST_BONES, [0.0; 4]);
    rows
}

/// `None` where the view does not show it, or shows less than a pixel.
fn body_uniform(
    placed: &Placed,
    view: &Pinhole,
    (object, tint): (u16, [u8; 3]),
    world_from_body: &DAffine3,
) -> Option<BodyUniform> {
    let body = &placed.body;
    let [min, max] = body.bounds.map(|corner| Vec3::from(corner).as_dvec3());
    let eye_from_body = view.world_from_eye.to_affine().inverse() * *world_from_body;
    if !may_show(view, &eye_from_body, &camera::Bounds { min, max }) {
        return None;
    }
    let normals = world_from_body.matrix3.inverse().transpose();
    let steps = f32::from(u16::MAX);
    let [x, y, z] = body.least;
    let [step_x, step_y, step_z] = body.step.map(|step| step * steps);
    let [u, v] = body.least_uv;
    let [step_u, step_v] = body.step_uv.map(|step| step * steps);
    let [red, green, blue] = tint.map(|share| f32::from(share) / 255.0);
    let uniform = BodyUniform {
        eye_from_body: rows(eye_from_body),
        world_normal_from_body: rows(DAffine3::from_mat3(normals)),
        least: [x, y, z, 0.0],
        size: [step_x, step_y, step_z, 0.0],
        least_size_uv: [u, v, step_u, step_v],
        tint: [red, green, blue, 1.0],
        object: object.into(),
        material: placed.material.into(),
        bone_count: body.skin.as_ref().map_or(0, |skin| skin.clip.bones.into()),
        cut_out: placed.is_cut_out.into(),
        is_flat: body.normals.is_empty().into(),
        padding: [0; 3],
    };
    let mut numbers = uniform.eye_from_body.iter().chain(&uniform.world_normal_from_body).flatten();
    numbers.all(|number| number.is_finite()).then_some(uniform)
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    cull_mode: Option<wgpu::Face>,
) -> wgpu::RenderPipeline {
    let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("bodies"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("bodies"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("place"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<BodyVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &BodyVertex::ATTRIBUTES,
            })],
        },
        primitive: wgpu::PrimitiveState { cull_mode, ..wgpu::PrimitiveState::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: GBuffer::DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("show"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[GBuffer::COLOUR, GBuffer::NORMAL_IDS, GBuffer::W].map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_reads_what_is_written() {
        shaders::assert_layout!(
            BodyUniform,
            "client/body.wgsl",
            "Body",
            eye_from_body,
            world_normal_from_body,
            least,
            size,
            least_size_uv,
            tint,
            object,
            material,
            bone_count,
            cut_out,
            is_flat
        );
    }
}
