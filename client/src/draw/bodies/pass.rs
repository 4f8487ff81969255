//! The pass: one draw a body.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use gpu::{Gpu, PinholeUniform};
use protocol::Body;
use protocol::body::BoneRows;
use shaders::ShaderError;
use surface::GBuffer;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, ShaderStages};

use super::instances::{BodyInputs, Group, InstanceVertex, groups};
use super::placed::{BodyVertex, Placed};
use super::store::Bodies;
use crate::draw::fullscreen::{Binding, bind, layout, uniform};
use crate::draw::relief::onto;

const BINDINGS: [Binding; 5] =
    [Binding::Uniform, Binding::Uniform, Binding::Uniform, Binding::SampledTexture, Binding::Sampler];

/// `Body` of `client/body.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct BodyUniform {
    least: [f32; 4],
    size: [f32; 4],
    least_size_uv: [f32; 4],
    material: u32,
    is_flat: u32,
    mirrored: u32,
    setback: f32,
}

impl BodyUniform {
    fn new(placed: &Placed, is_mirrored: bool, setback: f32) -> BodyUniform {
        let body = &placed.body;
        let steps = f32::from(u16::MAX);
        let [x, y, z] = body.least;
        let [step_x, step_y, step_z] = body.step.map(|step| step * steps);
        let [u, v] = body.least_uv;
        let [step_u, step_v] = body.step_uv.map(|step| step * steps);
        BodyUniform {
            least: [x, y, z, 0.0],
            size: [step_x, step_y, step_z, 0.0],
            least_size_uv: [u, v, step_u, step_v],
            material: placed.material.into(),
            is_flat: body.normals.is_empty().into(),
            mirrored: is_mirrored.into(),
            setback,
        }
    }
}

/// How a body is drawn.
#[derive(Debug, Clone, Copy)]
struct Variant {
    culled: Option<wgpu::Face>,
    is_cut_out: bool,
    is_bent: bool,
}

impl Variant {
    const COUNT: usize = 12;

    fn of(placed: &Placed, is_mirrored: bool) -> Variant {
        let culled = match (placed.body.double_sided, is_mirrored) {
            (true, _) => None,
            (false, false) => Some(wgpu::Face::Back),
            (false, true) => Some(wgpu::Face::Front),
        };
        Variant { culled, is_cut_out: placed.is_cut_out, is_bent: placed.is_bent() }
    }

    fn index(self) -> usize {
        let side = match self.culled {
            None => 0,
            Some(wgpu::Face::Back) => 1,
            Some(wgpu::Face::Front) => 2,
        };
        4 * side + 2 * usize::from(self.is_cut_out) + usize::from(self.is_bent)
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct BodyPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    module: wgpu::ShaderModule,
    /// By [`Variant::index`], each made when it is first drawn by.
    pipelines: [OnceLock<wgpu::RenderPipeline>; Variant::COUNT],
    /// Of what is rigid: nothing of it is read.
    no_bones: wgpu::Buffer,
}

impl BodyPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<BodyPass, ShaderError> {
        let module = gpu.shader("client/body.wgsl")?;
        let layout = layout(gpu, "bodies", ShaderStages::VERTEX_FRAGMENT, &BINDINGS);
        let no_bones = uniform(gpu, "bones", bytemuck::cast_slice(&bone_rows(&[])));
        Ok(BodyPass { gpu: gpu.clone(), layout, module, pipelines: Default::default(), no_bones })
    }

    /// Draws all objects that bodies show into `target`, which holds surfaces of the same view.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, inputs: &BodyInputs<'_>, target: &GBuffer) {
        let groups = groups(inputs);
        if groups.is_empty() {
            return;
        }
        let view = PinholeUniform::new(inputs.camera, inputs.camera.world_from_eye.translation);
        let view = uniform(&self.gpu, "view", bytemuck::bytes_of(&view));
        let instances: Vec<InstanceVertex> = groups.iter().flat_map(|group| &group.instances).copied().collect();
        let instances = self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("body instances"),
            contents: bytemuck::cast_slice(&instances),
            usage: wgpu::BufferUsages::VERTEX,
        });
        let mut pass = onto(encoder, target, "bodies");
        let mut first = 0;
        for Group { placed, is_mirrored, instances: of_group, .. } in &groups {
            let body =
                uniform(&self.gpu, "body", bytemuck::bytes_of(&BodyUniform::new(placed, *is_mirrored, inputs.setback)));
            let own_bones = placed.is_bent().then(|| self.bones(inputs.bodies, placed));
            let bones = own_bones.as_ref().unwrap_or(&self.no_bones);
            let inputs = [
                view.as_entire_binding(),
                body.as_entire_binding(),
                bones.as_entire_binding(),
                BindingResource::TextureView(&placed.colours),
                BindingResource::Sampler(&placed.sampler),
            ];
            let variant = Variant::of(placed, *is_mirrored);
            let made = || pipeline(&self.gpu, &self.module, &self.layout, variant);
            pass.set_pipeline(self.pipelines[variant.index()].get_or_init(made));
            pass.set_bind_group(0, &bind(&self.gpu, "body", &self.layout, &inputs), &[]);
            // By its place in the buffer: WebGL2 draws no instances that begin past the first one.
            let stride = size_of::<InstanceVertex>() as u64;
            pass.set_vertex_buffer(0, placed.vertices.slice(..));
            pass.set_vertex_buffer(1, instances.slice(first * stride..));
            pass.set_index_buffer(placed.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..placed.body.indices.len() as u32, 0, 0..of_group.len() as u32);
            first += of_group.len() as u64;
        }
    }

    fn bones(&self, bodies: &Bodies, placed: &Placed) -> wgpu::Buffer {
        uniform(&self.gpu, "bones", bytemuck::cast_slice(&bone_rows(&bodies.bones(placed))))
    }
}

/// Three rows a bone, with room for the most.
fn bone_rows(bones: &[BoneRows]) -> Vec<[f32; 4]> {
    let mut rows = bones.as_flattened().to_vec();
    rows.resize(3 * Body::MOST_BONES, [0.0; 4]);
    rows
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    variant: Variant,
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
            entry_point: Some(if variant.is_bent { "place_bent" } else { "place" }),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<BodyVertex>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &BodyVertex::ATTRIBUTES,
                }),
                Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<InstanceVertex>() as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &InstanceVertex::ATTRIBUTES,
                }),
            ],
        },
        primitive: wgpu::PrimitiveState { cull_mode: variant.culled, ..wgpu::PrimitiveState::default() },
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
            entry_point: Some(if variant.is_cut_out { "show_cut" } else { "show" }),
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
            least,
            size,
            least_size_uv,
            material,
            is_flat,
            mirrored,
            setback
        );
    }
}
