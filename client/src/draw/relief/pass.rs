//! The pass: one instanced draw a relief.

use std::collections::BTreeMap;

use camera::Pinhole;
use glam::DAffine3;
use gpu::{Gpu, PinholeUniform};
use protocol::Held;
use shaders::ShaderError;
use surface::GBuffer;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, BufferUsages, LoadOp, Operations, ShaderStages, StoreOp};

use super::instances::{self, InstanceVertex};
use crate::draw::fullscreen::{Binding, bind, layout, uniform};
use crate::draw::impostors::{Impostors, Placed, PlacedCamera};

/// Vertices of the strip of triangles around a box.
const STRIP_VERTICES: u32 = 14;

/// Fine steps are a pixel of the relief: shorter ones follow a curved projection no more closely than its samples lie.
const FINE_PX: f32 = 1.0;

const BINDINGS: [Binding; 7] = [
    Binding::Uniform,
    Binding::Uniform,
    Binding::Uniform,
    Binding::FloatTexture,
    Binding::FloatTexture,
    Binding::UintTexture,
    Binding::FloatTexture,
];

/// What is drawn, and from where.
pub(crate) struct ReliefInputs<'a> {
    pub impostors: &'a Impostors,
    pub held: &'a Held,
    pub poses_now: &'a BTreeMap<u16, DAffine3>,
    pub camera: &'a Pinhole,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct ReliefPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl ReliefPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<ReliefPass, ShaderError> {
        let module = gpu.shader("client/relief.wgsl")?;
        let layout = layout(gpu, "reliefs", ShaderStages::VERTEX_FRAGMENT, &BINDINGS);
        let pipeline = pipeline(gpu, &module, &layout);
        Ok(ReliefPass { gpu: gpu.clone(), layout, pipeline })
    }

    /// Draws all objects that reliefs show into `target`, which holds surfaces of the same view.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, inputs: &ReliefInputs<'_>, target: &GBuffer) {
        let shown = instances::shown(inputs.impostors, (inputs.held, inputs.poses_now), inputs.camera);
        if shown.is_empty() {
            return;
        }
        let view = PinholeUniform::new(inputs.camera, inputs.camera.world_from_eye.translation);
        let view = uniform(&self.gpu, "view", bytemuck::bytes_of(&view));
        let mut pass = onto(encoder, target, "reliefs");
        pass.set_pipeline(&self.pipeline);
        for (relief, instances) in &shown {
            self.draw(&mut pass, &view, relief, instances);
        }
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        view: &wgpu::Buffer,
        relief: &Placed,
        instances: &[InstanceVertex],
    ) {
        // Through a graph camera there are other walks; nobody sends such a relief.
        let (PlacedCamera::Pinhole(camera) | PlacedCamera::Spoc(camera)) = &relief.camera else { return };
        let image = uniform(&self.gpu, "impostor", bytemuck::bytes_of(&relief.walked_by(FINE_PX)));
        let uniforms = [view, &image, camera].map(wgpu::Buffer::as_entire_binding);
        let inputs: Vec<BindingResource<'_>> = uniforms.into_iter().chain(relief.textures()).collect();
        let buffer = self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("objects of a relief"),
            contents: bytemuck::cast_slice(instances),
            usage: BufferUsages::VERTEX,
        });
        pass.set_bind_group(0, &bind(&self.gpu, "relief", &self.layout, &inputs), &[]);
        pass.set_vertex_buffer(0, buffer.slice(..));
        pass.draw(0..STRIP_VERTICES, 0..instances.len() as u32);
    }
}

/// A pass onto what is there.
pub(crate) fn onto<'a>(encoder: &'a mut wgpu::CommandEncoder, target: &GBuffer, label: &str) -> wgpu::RenderPass<'a> {
    let views = &target.views;
    let attachment = |view| {
        let ops = Operations { load: LoadOp::Load, store: StoreOp::Store };
        Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[&views.colour, &views.normal_ids, &views.w].map(attachment),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &views.depth,
            depth_ops: Some(Operations { load: LoadOp::Load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn pipeline(gpu: &Gpu, module: &wgpu::ShaderModule, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("reliefs"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("reliefs"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("box"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<InstanceVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &InstanceVertex::ATTRIBUTES,
            })],
        },
        // Back faces: one fragment a pixel, wherever the eye is, and none of them is cut off by the near plane before what
        // the box holds is.
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            cull_mode: Some(wgpu::Face::Front),
            ..wgpu::PrimitiveState::default()
        },
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
            entry_point: Some("draw"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[GBuffer::COLOUR, GBuffer::NORMAL_IDS, GBuffer::W].map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}
