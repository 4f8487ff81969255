//! The pipelines of a pass over the scene: one for each way in which materials differ.

use gpu::Gpu;
use scene::Vertex;

use super::error::RenderError;

/// The depth buffer of every pass: reversed, so that near is 1.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Of group 1: the plane that cuts the scene open.
const SECTION: u32 = 3;

/// The bind group layouts that all passes share. Two of one device are compatible.
#[derive(Debug, Clone)]
pub struct Layouts {
    /// Group 0: the camera.
    pub(crate) view: wgpu::BindGroupLayout,
    /// Group 1: instances, materials, second texture coordinates and the section, and the vertices where they are pulled.
    pub(crate) scene: wgpu::BindGroupLayout,
    /// Group 2: the textures of a material, base colour and normals, and its codes.
    pub(crate) texture: wgpu::BindGroupLayout,
}

/// A binding of a buffer.
pub(crate) fn buffer_entry(
    binding: u32,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

/// A plane that fragments read texel by texel.
pub(crate) fn texture_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

impl Layouts {
    /// Layouts for scenes with triangles told natively, or by pulled vertices.
    pub(crate) fn new(gpu: &Gpu, native: bool) -> Layouts {
        // Where there is compute, passes that prepare a draw read the scene too.
        let compute = if gpu.caps.compute { wgpu::ShaderStages::COMPUTE } else { wgpu::ShaderStages::NONE };
        let both = wgpu::ShaderStages::VERTEX_FRAGMENT | compute;
        let (uniform, storage) =
            (wgpu::BufferBindingType::Uniform, wgpu::BufferBindingType::Storage { read_only: true });
        let pulled = if native { 0 } else { 2 };
        let ty = |binding| if binding == SECTION { uniform } else { storage };
        let scene: Vec<_> = (0..4 + pulled).map(|binding| buffer_entry(binding, both, ty(binding))).collect();
        let texture = |binding| wgpu::BindGroupLayoutEntry {
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            ..texture_entry(binding)
        };
        let sampler = |binding| wgpu::BindGroupLayoutEntry {
            ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            ..texture_entry(binding)
        };
        let codes = |binding| wgpu::BindGroupLayoutEntry {
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            ..texture_entry(binding)
        };
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        Layouts {
            view: layout("camera", &[buffer_entry(0, both, uniform)]),
            scene: layout("scene", &scene),
            texture: layout("textures", &[texture(0), sampler(1), texture(2), sampler(3), codes(4), codes(5)]),
        }
    }
}

/// Which sides of triangles are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Faces {
    /// Those that face the camera's rays, and both of materials with two sides: what a camera sees.
    Front,
    /// Those that face away, and both of materials with two sides: the insides of glass.
    Back,
}

/// What makes one pass over the scene differ from another.
pub struct Pass<'a> {
    /// Entry point of the fragment stage in the `server/raster_….wgsl` files.
    pub fragment: &'static str,
    /// Of the colour targets, in order.
    pub formats: &'a [wgpu::TextureFormat],
    /// Layout of group 3.
    pub own_layout: Option<&'a wgpu::BindGroupLayout>,
    /// Values of the fragment stage's `override` constants beside `cut_out`, `detailed` and `opens`.
    pub constants: &'a [(&'a str, f64)],
    /// Which sides are drawn.
    pub faces: Faces,
}

/// Which pipelines draw a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneKind {
    /// Whether fragments are told their triangle; else the vertex stage pulls corners.
    pub native: bool,
    /// Whether any material has a normal map or varies from place to place.
    pub detailed: bool,
}

/// Which of a pass's pipelines draws an instance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variant {
    pub double_sided: bool,
    pub mirrored: bool,
    pub cut_out: bool,
    pub detailed: bool,
}

/// See `Pipelines::of`.
#[derive(Clone)]
pub struct Pipelines {
    /// One side culled, the same mirrored, both sides drawn; each without and with cut-outs.
    plain: Vec<[wgpu::RenderPipeline; 2]>,
    /// The same for materials of detail; none where a scene has none.
    detailed: Vec<[wgpu::RenderPipeline; 2]>,
    faces: Faces,
}

/// In the order of [`Pipelines::plain`].
fn sides(faces: Faces) -> [(wgpu::FrontFace, Option<wgpu::Face>); 3] {
    let culled = match faces {
        Faces::Front => wgpu::Face::Back,
        Faces::Back => wgpu::Face::Front,
    };
    [(wgpu::FrontFace::Ccw, Some(culled)), (wgpu::FrontFace::Cw, Some(culled)), (wgpu::FrontFace::Ccw, None)]
}

impl Pipelines {
    /// Builds the pipelines of a pass, for scenes with triangles told natively or by pulled vertices.
    pub fn new(gpu: &Gpu, kind: SceneKind, pass: &Pass<'_>) -> Result<Pipelines, RenderError> {
        let file = if kind.native { "server/raster_native.wgsl" } else { "server/raster_pulled.wgsl" };
        Pipelines::of_file(gpu, file, kind, pass)
    }

    /// The same with the entry points of another file; not native, its vertex stage has no vertex buffers.
    pub(crate) fn of_file(gpu: &Gpu, file: &str, kind: SceneKind, pass: &Pass<'_>) -> Result<Pipelines, RenderError> {
        let layouts = Layouts::new(gpu, kind.native);
        let module = gpu.shader(file)?;
        let groups = [Some(&layouts.view), Some(&layouts.scene), Some(&layouts.texture), pass.own_layout];
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(pass.fragment),
            bind_group_layouts: &groups[..if pass.own_layout.is_some() { 4 } else { 3 }],
            immediate_size: 0,
        });
        let all = |detailed: bool| {
            let build =
                |sides, cut_out| pipeline(gpu, (&module, &layout), kind.native, pass, sides, [cut_out, detailed]);
            sides(pass.faces).into_iter().map(|sides| [build(sides, false), build(sides, true)]).collect()
        };
        let faces = pass.faces;
        Ok(Pipelines { plain: all(false), detailed: if kind.detailed { all(true) } else { Vec::new() }, faces })
    }

    /// Whether the insides of what a section opens are drawn: by passes of what a camera sees.
    pub(super) fn opens(&self) -> bool {
        self.faces == Faces::Front
    }

    /// The pipeline for a kind of instance.
    pub(super) fn of(&self, variant: Variant) -> &wgpu::RenderPipeline {
        let sides = if variant.double_sided { 2 } else { usize::from(variant.mirrored) };
        let all = if variant.detailed { &self.detailed } else { &self.plain };
        &all[sides][usize::from(variant.cut_out)]
    }
}

fn pipeline(
    gpu: &Gpu,
    (module, layout): (&wgpu::ShaderModule, &wgpu::PipelineLayout),
    native: bool,
    pass: &Pass<'_>,
    (front_face, cull_mode): (wgpu::FrontFace, Option<wgpu::Face>),
    flags: [bool; 2],
) -> wgpu::RenderPipeline {
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Unorm8x4];
    let vertices = [Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    })];
    let flags = ["cut_out", "detailed"].into_iter().zip(flags.map(|flag| f64::from(u8::from(flag))));
    let opens = ("opens", f64::from(u8::from(pass.faces == Faces::Front)));
    let constants: Vec<(&str, f64)> = pass.constants.iter().copied().chain(flags).chain([opens]).collect();
    let targets: Vec<_> = pass.formats.iter().map(|&format| Some(format.into())).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(pass.fragment),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: if native { &vertices } else { &[] },
        },
        primitive: wgpu::PrimitiveState { front_face, cull_mode, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(pass.fragment),
            compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Group 1: buffers in the order of their bindings.
pub(super) fn scene_group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let entries: Vec<_> = (0_u32..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("scene"), layout, entries: &entries })
}
