//! A pass over every pixel of its targets: one triangle, textures read by texel, uniforms.

use gpu::Gpu;
use wgpu::{BindingResource, ShaderStages, TextureFormat, TextureSampleType, TextureView};

/// What a binding holds, in the order of the shader's bindings.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Binding {
    Uniform,
    FloatTexture,
    UintTexture,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct FullscreenPass {
    gpu: Gpu,
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl FullscreenPass {
    /// The fragment entry point `fragment` of the shader at `path`.
    pub(crate) fn new(
        gpu: &Gpu,
        path: &str,
        fragment: &'static str,
        bindings: &[Binding],
        formats: &[TextureFormat],
    ) -> Result<FullscreenPass, shaders::ShaderError> {
        let device = &gpu.device;
        let module = gpu.shader(path)?;
        let entries: Vec<_> = bindings.iter().zip(0..).map(|(binding, index)| layout_entry(index, *binding)).collect();
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(fragment), entries: &entries });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(fragment),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let targets: Vec<_> = formats.iter().map(|&format| Some(wgpu::ColorTargetState::from(format))).collect();
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("fullscreen"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Ok(FullscreenPass { gpu: gpu.clone(), label: fragment, layout, pipeline })
    }

    /// Draws over all of `targets`.
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &[BindingResource<'_>],
        targets: &[&TextureView],
    ) {
        let entries: Vec<_> = inputs
            .iter()
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.label),
            layout: &self.layout,
            entries: &entries,
        });
        let attachments: Vec<_> = targets
            .iter()
            .map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(self.label),
            color_attachments: &attachments,
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn layout_entry(binding: u32, kind: Binding) -> wgpu::BindGroupLayoutEntry {
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let ty = match kind {
        Binding::Uniform => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        Binding::FloatTexture => texture(TextureSampleType::Float { filterable: false }),
        Binding::UintTexture => texture(TextureSampleType::Uint),
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: ShaderStages::FRAGMENT, ty, count: None }
}

/// A texture that one pass draws and later ones read.
#[derive(Debug)]
pub(crate) struct Target {
    pub(crate) texture: wgpu::Texture,
    pub(crate) view: TextureView,
}

impl Target {
    /// Sides below one pixel become one.
    pub(crate) fn new(gpu: &Gpu, label: &str, (width, height): (u32, u32), format: TextureFormat) -> Target {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: width.max(1), height: height.max(1), depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Target { texture, view }
    }
}

/// A uniform buffer of one frame.
pub(crate) fn uniform(gpu: &Gpu, label: &str, contents: &[u8]) -> wgpu::Buffer {
    use wgpu::util::DeviceExt;
    let usage = wgpu::BufferUsages::UNIFORM;
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
}
