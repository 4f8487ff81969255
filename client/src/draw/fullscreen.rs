//! A pass over the pixels of its targets: one triangle over all of them, or squares over some; textures read by texel, uniforms.

use gpu::Gpu;
use wgpu::{BindingResource, ShaderStages, TextureFormat, TextureSampleType, TextureView, TextureViewDimension};

/// Why passes that are made while drawing can be made.
pub(crate) const EMBEDDED: &str = "the shaders are embedded, and tests compose each of them";

/// What a binding holds, in the order of the shader's bindings.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Binding {
    Uniform,
    FloatTexture,
    /// Layers.
    FloatTextures,
    UintTexture,
    /// A texture that a sampler reads, and that sampler.
    SampledTexture,
    Sampler,
}

/// What a pass does to what its targets hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Onto {
    /// Takes its place, or clears it where the shader discards.
    Nothing,
    /// Lies over it.
    Picture,
    /// Lies over it where its depth is greater.
    Depth,
    /// Adds to it.
    Sum,
}

impl Onto {
    /// Of a pass onto [`Onto::Depth`].
    pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
}

/// What a pass runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Program<'a> {
    /// The shader's file.
    pub path: &'a str,
    /// Its vertex entry point; [`FULLSCREEN`] covers the targets.
    pub vertex: &'static str,
    /// Its fragment entry point, which also names the pass.
    pub fragment: &'static str,
    /// Values of `override` constants.
    pub constants: &'a [(&'a str, f64)],
}

/// The vertices of `client/fullscreen.wgsl`.
pub(crate) const FULLSCREEN: &str = "fullscreen";

impl<'a> Program<'a> {
    /// Over all of the targets.
    pub(crate) fn fullscreen(path: &'a str, fragment: &'static str) -> Program<'a> {
        Program { path, vertex: FULLSCREEN, fragment, constants: &[] }
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct FullscreenPass {
    gpu: Gpu,
    label: &'static str,
    onto: Onto,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl FullscreenPass {
    /// The fragment entry point `fragment` of the shader at `path`, onto nothing.
    pub(crate) fn new(
        gpu: &Gpu,
        path: &str,
        fragment: &'static str,
        bindings: &[Binding],
        formats: &[TextureFormat],
    ) -> Result<FullscreenPass, shaders::ShaderError> {
        FullscreenPass::onto(Onto::Nothing, gpu, (path, fragment), bindings, formats)
    }

    /// [`FullscreenPass::new`] onto something.
    pub(crate) fn onto(
        onto: Onto,
        gpu: &Gpu,
        (path, fragment): (&str, &'static str),
        bindings: &[Binding],
        formats: &[TextureFormat],
    ) -> Result<FullscreenPass, shaders::ShaderError> {
        FullscreenPass::of(gpu, Program::fullscreen(path, fragment), onto, bindings, formats)
    }

    /// A pass that runs any program. Vertices of one that does not cover the targets read the same bindings.
    pub(crate) fn of(
        gpu: &Gpu,
        program: Program<'_>,
        onto: Onto,
        bindings: &[Binding],
        formats: &[TextureFormat],
    ) -> Result<FullscreenPass, shaders::ShaderError> {
        let Program { path, vertex, fragment, constants } = program;
        let device = &gpu.device;
        let module = gpu.shader(path)?;
        let by_fragments = vertex == FULLSCREEN;
        let visibility = if by_fragments { ShaderStages::FRAGMENT } else { ShaderStages::VERTEX_FRAGMENT };
        let layout = layout(gpu, fragment, visibility, bindings);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(fragment),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let add = wgpu::BlendComponent { dst_factor: wgpu::BlendFactor::One, ..wgpu::BlendComponent::REPLACE };
        let blend = (onto == Onto::Sum).then_some(wgpu::BlendState { color: add, alpha: add });
        let target = |&format| wgpu::ColorTargetState { blend, ..wgpu::ColorTargetState::from(format) };
        let targets: Vec<_> = formats.iter().map(|format| Some(target(format))).collect();
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: (onto == Onto::Depth).then_some(wgpu::DepthStencilState {
                format: Onto::DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Ok(FullscreenPass { gpu: gpu.clone(), label: fragment, onto, layout, pipeline })
    }

    /// Draws over all of `targets`; of a pass that is not onto [`Onto::Depth`].
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &[BindingResource<'_>],
        targets: &[&TextureView],
    ) {
        let clears = self.onto == Onto::Nothing;
        let mut pass = begin(encoder, self.label, clears, targets, None);
        self.draw(&mut pass, inputs);
    }

    /// Draws in a pass with the targets that it was made for.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, inputs: &[BindingResource<'_>]) {
        self.draw_corners(pass, inputs, 3, 1);
    }

    /// The same by a program that draws so many squares of four vertices, an instance each.
    pub(crate) fn draw_squares(&self, pass: &mut wgpu::RenderPass<'_>, inputs: &[BindingResource<'_>], count: u32) {
        self.draw_corners(pass, inputs, 4, count);
    }

    fn draw_corners(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        inputs: &[BindingResource<'_>],
        corners: u32,
        instances: u32,
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bind(&self.gpu, self.label, &self.layout, inputs), &[]);
        pass.draw(0..corners, 0..instances);
    }
}

/// A render pass to draw in. Colours that are cleared are 0 then; a depth always is, and is not kept.
pub(crate) fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
    clears: bool,
    targets: &[&TextureView],
    depth: Option<&TextureView>,
) -> wgpu::RenderPass<'a> {
    let load = if clears { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let attachment =
        |view| Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
    let attachments: Vec<_> = targets.iter().map(|&view| attachment(view)).collect();
    let depth = depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
        stencil_ops: None,
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &attachments,
        depth_stencil_attachment: depth,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

/// The layout of a group with these bindings, for one or more stages.
pub(crate) fn layout(gpu: &Gpu, label: &str, visibility: ShaderStages, bindings: &[Binding]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> =
        bindings.iter().zip(0..).map(|(kind, binding)| layout_entry(binding, visibility, *kind)).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    gpu.device.create_bind_group_layout(&descriptor)
}

/// A group of inputs, in the order of its bindings.
pub(crate) fn bind(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    inputs: &[BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = inputs
        .iter()
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

fn layout_entry(binding: u32, visibility: ShaderStages, kind: Binding) -> wgpu::BindGroupLayoutEntry {
    let texture =
        |sample_type, view_dimension| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
    let ty = match kind {
        Binding::Uniform => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        Binding::FloatTexture => texture(TextureSampleType::Float { filterable: false }, TextureViewDimension::D2),
        Binding::FloatTextures => {
            texture(TextureSampleType::Float { filterable: false }, TextureViewDimension::D2Array)
        }
        Binding::UintTexture => texture(TextureSampleType::Uint, TextureViewDimension::D2),
        Binding::SampledTexture => texture(TextureSampleType::Float { filterable: true }, TextureViewDimension::D2),
        Binding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
    };
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
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
