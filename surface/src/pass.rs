use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use gpu::uniforms::Rows;
use wgpu::util::DeviceExt;

use crate::SurfaceError;
use crate::gbuffer::GBuffer;
use crate::held::HeldSurfaces;
use crate::mesh::Vertex;
use crate::patch::{PatchSurface, QuadBuffers};
use crate::placement::{MOVER_TEXELS, Placement, movers_texture};
use crate::slices::Slices;

/// What colour and normal are between the centres of two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Smoothing {
    /// Constant over each quad.
    None,
    /// The sample's own at its centre, and from there on the slope that its corners show, which are means of the samples of one
    /// surface; half of what the sample differs from them is left on its border. Against a mix of the sample and its corners
    /// that ends on the border, FLIP over covered pixels falls by 5 % (nest of twigs), 6 % (street) and 15 % (room of pillars).
    #[default]
    Blended,
    /// Linear between the means at the corners.
    Linear,
}

/// `View` of `surface/quads.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct ViewUniform {
    eye_from_patch: Rows,
    centre_px: [f32; 2],
    focal_px: f32,
    first_mover: u32,
    clip_scale: [f32; 2],
    clip_shift: [f32; 2],
    near_m: f32,
    smoothing: u32,
    /// Its id, for what asks which sample it sees.
    patch: u32,
    setback: f32,
}

/// A sample is tested against others as if it lay this many of its footprints (what a pixel spans at its depth, where it was captured)
/// further from the eye. So of overlapping samples of one surface the finer shows, in one pass: their depths differ by less, through
/// coding, averaged corners and curvature. What lies nearer before another surface than the difference of both footprints would
/// show it through; a server sees that in its own drawing of the copy, and sends the nearer surface as finely.
pub const SETBACK_FOOTPRINTS: f64 = 0.5;

/// By so many times as much more, for an eye that looks from aside by its whole distance: of samples that are equally fine those show that were taken from
/// nearest to where the eye is, whose outlines are as it sees them, and which it sees no more at a slant than they were taken. (Blending by the angle between
/// rays, as Buehler et al., Unstructured lumigraph rendering, 2001, without the blending.) With it four images of a nest of twigs
/// are seen with FLIP 0.041, without 0.047.
const SETBACK_ASIDE: f64 = 4.0;
/// From further aside than this, some 14 degrees, nothing is set back any further: what is thin would be shown behind what it hides.
const MOST_ASIDE: f64 = 0.25;

/// Draws [`HeldSurfaces`] into a [`GBuffer`]; the nearest surface wins.
#[derive(Debug)]
pub struct SurfacePass(Quads);

impl SurfacePass {
    /// Compiles the pipeline.
    pub fn new(gpu: &Gpu) -> Result<SurfacePass, SurfaceError> {
        let quads = Quads::new(gpu, ("vertex", "fragment"), &SurfacePass::FORMATS, Some(wgpu::Face::Back))?;
        Ok(SurfacePass(Quads { coarsens: true, ..quads }))
    }

    /// The same, but each sample is shown, however fine, by the colour that [`HeldSurfaces::set_tint`] asks for.
    pub fn tinted(gpu: &Gpu) -> Result<SurfacePass, SurfaceError> {
        Ok(SurfacePass(Quads::new(gpu, ("vertex", "tinted"), &SurfacePass::FORMATS, Some(wgpu::Face::Back))?))
    }

    /// Draws what casts shadows, as seen from a light: everything from both sides, as a body whose lit side nobody has seen casts the
    /// shadow of its other one, and with half of its own footprint added to each sample's distance from the light, also in
    /// [`GBuffer::w`] (see [`SETBACK_FOOTPRINTS`]): samples of one surface differ by less, so none shadows another. Colour and
    /// normal are left empty.
    pub fn casting(gpu: &Gpu) -> Result<SurfacePass, SurfaceError> {
        Ok(SurfacePass(Quads::new(gpu, ("vertex", "casting"), &SurfacePass::FORMATS, None)?))
    }

    const FORMATS: [wgpu::TextureFormat; 3] = [GBuffer::COLOUR, GBuffer::NORMAL_IDS, GBuffer::W];

    /// Clears the targets and draws everything held as seen by `camera`, whose size is the targets'.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
        smoothing: Smoothing,
        target: &GBuffer,
    ) {
        self.encode_slice(encoder, (surfaces, &mut Slices::default(), usize::MAX), camera, smoothing, target);
    }

    /// The next slice of the same, of so many quads at most; the first one clears the targets. Between two slices of a view neither camera nor
    /// targets may change; what is held may, and then shows as it was or as it is.
    pub fn encode_slice(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (surfaces, slices, most_quads): (&HeldSurfaces, &mut Slices, usize),
        camera: &Pinhole,
        smoothing: Smoothing,
        target: &GBuffer,
    ) {
        let views = &target.views;
        let targets = [&views.colour, &views.normal_ids, &views.w];
        let meant = Meant { surfaces, is_meant: &|_| true, slices, most_quads };
        self.0.encode_meant(encoder, meant, camera, smoothing, (&targets, &views.depth));
    }
}

/// Draws what casts shadows as [`SurfacePass::casting`] does, but no more than a shadow map needs: inverse depths.
#[derive(Debug)]
pub struct CastPass(Quads);

impl CastPass {
    /// See [`CastPass::of_planes`].
    pub const PLANES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

    /// Compiles the pipeline.
    pub fn new(gpu: &Gpu) -> Result<CastPass, SurfaceError> {
        Ok(CastPass(Quads::new(gpu, ("cast_vertex", "casting_w"), &[GBuffer::W], None)?))
    }

    /// Inverse depths with their changes a pixel right and down, onto [`CastPass::PLANES`] in place of [`GBuffer::W`].
    pub fn of_planes(gpu: &Gpu) -> Result<CastPass, SurfaceError> {
        Ok(CastPass(Quads::new(gpu, ("cast_vertex", "casting_plane"), &[CastPass::PLANES], None)?))
    }

    /// Clears the targets, of [`GBuffer::W`] and [`GBuffer::DEPTH`], and draws everything held as seen by `camera`, whose size is theirs.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
        (w, depth): (&wgpu::TextureView, &wgpu::TextureView),
    ) {
        self.encode_some(encoder, surfaces, camera, (w, depth), |_| true);
    }

    /// The same of those patches whose cameras are asked for.
    pub fn encode_some(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
        (w, depth): (&wgpu::TextureView, &wgpu::TextureView),
        is_drawn: impl Fn(&Pinhole) -> bool,
    ) {
        let meant = Meant { surfaces, is_meant: &is_drawn, slices: &mut Slices::default(), most_quads: usize::MAX };
        self.0.encode_meant(encoder, meant, camera, Smoothing::None, (&[w], depth));
    }
}

/// The next slice of what is held, of patches of some cameras.
struct Meant<'a> {
    surfaces: &'a HeldSurfaces,
    is_meant: &'a dyn Fn(&Pinhole) -> bool,
    slices: &'a mut Slices,
    most_quads: usize,
}

/// The pipeline that draws the quads of all patches with a vertex and a fragment stage of `surface/quads.wgsl`.
#[derive(Debug)]
pub(crate) struct Quads {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    both_sides: wgpu::RenderPipeline,
    /// Of surfaces that have one side.
    one_sided: wgpu::RenderPipeline,
    /// Whether it draws what an eye sees, not what casts.
    is_seen: bool,
    /// Whether quads are no finer than its pixels ask for.
    coarsens: bool,
}

impl Quads {
    /// `unseen` says which face of a surface of one side is not drawn.
    pub(crate) fn new(
        gpu: &Gpu,
        stages: (&str, &str),
        formats: &[wgpu::TextureFormat],
        unseen: Option<wgpu::Face>,
    ) -> Result<Quads, SurfaceError> {
        let module = gpu.shader("surface/quads.wgsl")?;
        let layout = bind_group_layout(gpu);
        let pipeline = |cull| pipeline(gpu, &module, &layout, stages, formats, cull);
        let both_sides = pipeline(None);
        let one_sided = unseen.map_or_else(|| both_sides.clone(), |face| pipeline(Some(face)));
        Ok(Quads { gpu: gpu.clone(), layout, both_sides, one_sided, is_seen: unseen.is_some(), coarsens: false })
    }

    /// Clears the targets and draws everything held; for what only servers ask.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
        smoothing: Smoothing,
        targets: &[&wgpu::TextureView],
        depth: &wgpu::TextureView,
    ) {
        let all = Meant { surfaces, is_meant: &|_| true, slices: &mut Slices::default(), most_quads: usize::MAX };
        self.encode_meant(encoder, all, camera, smoothing, (targets, depth));
    }

    fn encode_meant(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        Meant { surfaces, is_meant, slices, most_quads }: Meant<'_>,
        camera: &Pinhole,
        smoothing: Smoothing,
        (targets, depth): (&[&wgpu::TextureView], &wgpu::TextureView),
    ) {
        let stride = (size_of::<ViewUniform>() as u32)
            .next_multiple_of(self.gpu.device.limits().min_uniform_buffer_offset_alignment);
        let inputs = Inputs::new(surfaces, camera, self.is_seen, smoothing, stride as usize);
        let group = (!inputs.views.is_empty()).then(|| self.bind(&inputs));
        let mut pass = begin(encoder, slices.is_first(), targets, depth);
        let mut slice = slices.next(most_quads);
        let Some(group) = group else { return };
        for (index, (id, patch)) in surfaces.patches().enumerate() {
            let QuadBuffers::Gpu { vertices, indices, parts, .. } = &patch.quads else { continue };
            if slice.is_over() {
                break;
            }
            if slice.is_drawn(id) || !is_meant(&patch.camera) || !patch.may_be_seen_from(camera) {
                continue;
            }
            // What casts is drawn from both sides.
            let is_one_sided = surfaces.is_one_sided(patch);
            let seen = parts.seen_from(camera, &patch.camera, (self.coarsens, is_one_sided && self.is_seen));
            let seen = slice.cut(id, seen);
            if seen.is_empty() {
                continue;
            }
            pass.set_pipeline(if is_one_sided { &self.one_sided } else { &self.both_sides });
            pass.set_bind_group(0, &group, &[index as u32 * stride]);
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            seen.into_iter().for_each(|range| pass.draw_indexed(range, 0, 0..1));
        }
    }

    fn bind(&self, inputs: &Inputs) -> wgpu::BindGroup {
        let device = &self.gpu.device;
        let views = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("views of the patches"),
            contents: &inputs.views,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let movers = movers_texture(&self.gpu, inputs.movers.clone());
        let view_size = wgpu::BufferSize::new(size_of::<ViewUniform>() as u64);
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surfaces"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: &views,
                        offset: 0,
                        size: view_size,
                    }),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(
                        &movers.create_view(&wgpu::TextureViewDescriptor::default()),
                    ),
                },
            ],
        })
    }
}

/// What one frame uploads.
struct Inputs {
    /// A [`ViewUniform`] a patch, `stride` bytes apart.
    views: Vec<u8>,
    /// [`MOVER_TEXELS`] a moving object of each patch.
    movers: Vec<[f32; 4]>,
}

impl Inputs {
    fn new(surfaces: &HeldSurfaces, output: &Pinhole, is_seen: bool, smoothing: Smoothing, stride: usize) -> Inputs {
        let eye_from_world = output.world_from_eye.inverse().to_affine();
        let is_seen = is_seen && surfaces.is_for_eyes();
        let mut inputs = Inputs { views: vec![0; surfaces.patches().len() * stride], movers: Vec::new() };
        for (index, (id, patch)) in surfaces.patches().enumerate() {
            let first_mover = inputs.movers.len() as u32 / MOVER_TEXELS;
            let placement = Placement::new(surfaces, patch, &eye_from_world);
            let mut view = view_uniform(patch, output, smoothing, placement.eye_from_patch, first_mover);
            view.setback = setback(patch, is_seen.then_some(output));
            view.patch = id.0;
            view.smoothing |= surfaces.tint_code(patch);
            inputs.views[index * stride..][..size_of::<ViewUniform>()].copy_from_slice(bytemuck::bytes_of(&view));
            for mover in &placement.movers {
                inputs.movers.extend(mover.eye_from_patch);
                inputs.movers.extend(mover.turn);
            }
        }
        inputs
    }
}

fn view_uniform(
    patch: &PatchSurface,
    output: &Pinhole,
    smoothing: Smoothing,
    eye_from_patch: Rows,
    first_mover: u32,
) -> ViewUniform {
    let clip_from_eye = output.clip_from_eye();
    ViewUniform {
        eye_from_patch,
        centre_px: patch.camera.centre_px.as_vec2().to_array(),
        focal_px: patch.camera.focal_px as f32,
        first_mover,
        clip_scale: [clip_from_eye.x_axis.x, clip_from_eye.y_axis.y],
        clip_shift: [clip_from_eye.z_axis.x, clip_from_eye.z_axis.y],
        near_m: output.near_m as f32,
        smoothing: match smoothing {
            Smoothing::None => 0,
            Smoothing::Blended => 1,
            Smoothing::Linear => 2,
        },
        patch: 0,
        setback: 0.0,
    }
}

/// How far a patch's samples are set back, as a share of their distance from where they were captured; `seen_by`: where an eye sees them.
pub(crate) fn setback(patch: &PatchSurface, seen_by: Option<&Pinhole>) -> f32 {
    let aside =
        seen_by.map_or(0.0, |view| SETBACK_ASIDE * patch.aside_of(view.world_from_eye.translation).min(MOST_ASIDE));
    (SETBACK_FOOTPRINTS * (1.0 + aside) / patch.camera.focal_px) as f32
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    clears: bool,
    targets: &[&wgpu::TextureView],
    depth: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    let load = if clears { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
    let load_depth = if clears { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
    let attachment = |view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })
    };
    let targets: Vec<_> = targets.iter().copied().map(attachment).collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("surfaces"),
        color_attachments: &targets,
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations { load: load_depth, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn bind_group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("surfaces"),
        entries: &[
            wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: wgpu::BufferSize::new(size_of::<ViewUniform>() as u64),
                },
                count: None,
            },
            wgpu::BindGroupLayoutEntry {
                binding: 1,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            },
        ],
    })
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    (vertex, fragment): (&str, &str),
    formats: &[wgpu::TextureFormat],
    cull_mode: Option<wgpu::Face>,
) -> wgpu::RenderPipeline {
    let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("surfaces"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32, 2 => Uint32, 3 => Uint32, 4 => Uint32, 5 => Uint32, 6 => Uint32];
    let target = |&format| Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL });
    let targets: Vec<_> = formats.iter().map(target).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("surfaces"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        // A quad's triangles run counter-clockwise where it was captured from.
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
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
