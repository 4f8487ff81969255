//! The surfaces as a graph camera sees them, as points: its z-buffer, unprojected once when it is drawn.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.3, keep depths and unproject
//! a sample each time it is asked for. That needs the sample's frustum beside its depth, and every sample is asked for by many
//! pixels around it; so here the target holds the points themselves. Every frustum takes one draw of the patches that reach into it,
//! and what lies outside of its planes is discarded; as inverse depth is continuous over the frusta, one depth buffer serves all.

use bytemuck::{Pod, Zeroable};
use camera::{Frustum, GraphCamera};
use glam::{DAffine3, DMat3, DVec3, DVec4, Mat3};
use gpu::Gpu;
use gpu::uniforms::Rows;
use wgpu::util::DeviceExt;

use crate::SurfaceError;
use crate::held::HeldSurfaces;
use crate::mesh::Vertex;
use crate::patch::{PatchSurface, QuadBuffers};
use crate::placement::{MOVER_TEXELS, Placement, movers_texture};

/// The twin of the constant in `surface/points.wgsl`: a face, its four sides, and three limits.
pub const FRUSTUM_PLANES: usize = 8;

/// `PatchView` of `surface/points.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct PatchUniform {
    image_from_patch: Rows,
    centre_px: [f32; 2],
    focal_px: f32,
    first_mover: u32,
}

/// `PointFrustum` of `surface/points.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct FrustumUniform {
    offset_from_image: [[f32; 4]; 3],
    centre_anchor: [f32; 3],
    near_q: f32,
    size_px: [f32; 2],
    padding: [f32; 2],
    planes: [[f32; 4]; FRUSTUM_PLANES],
}

/// Where a graph camera sees surfaces.
#[derive(Debug)]
pub struct PointBuffer {
    /// Width and height in pixels.
    pub size_px: (u32, u32),
    /// [`PointBuffer::POINTS`]: metres, world axes, relative to an anchor; alpha 1 where there is a surface, else all zero.
    pub points: wgpu::Texture,
    /// Of `points`.
    pub view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl PointBuffer {
    /// See [`PointBuffer::points`].
    pub const POINTS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
    const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// Of one size; both sides above zero.
    pub fn new(gpu: &Gpu, size_px: (u32, u32)) -> PointBuffer {
        use wgpu::TextureUsages as Usage;
        let texture = |label, format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: Usage::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let points = texture("graph points", PointBuffer::POINTS, Usage::TEXTURE_BINDING | Usage::COPY_SRC);
        let depth = texture("graph depth", PointBuffer::DEPTH, Usage::empty());
        let view = points.create_view(&wgpu::TextureViewDescriptor::default());
        let depth = depth.create_view(&wgpu::TextureViewDescriptor::default());
        PointBuffer { size_px, points, view, depth }
    }
}

/// A frustum's projection in f64, scaled so that f32 holds it: the same numbers for drawing, unprojecting, and looking up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Takes world points to `(u q, v q, q)`.
    pub image_from_world: DAffine3,
    /// The matrix of it, rounded to f32: takes a point, less the centre, to `(u q, v q, q)`.
    pub image_from_offset: Mat3,
    /// `w = w_scale/q`.
    pub w_scale: f64,
}

impl Projection {
    /// Of a frustum.
    pub fn new(frustum: &Frustum) -> Projection {
        let clip = frustum.clip_from_offset();
        let matrix = clip.matrix.as_dmat3();
        let image_from_world = DAffine3::from_mat3_translation(matrix, -(matrix * frustum.centre_world()));
        Projection { image_from_world, image_from_offset: clip.matrix, w_scale: clip.w_scale }
    }
}

/// Draws [`HeldSurfaces`] into a [`PointBuffer`].
#[derive(Debug)]
pub struct PointPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    both_sides: wgpu::RenderPipeline,
    front_only: wgpu::RenderPipeline,
}

/// A draw: which patch in which frustum of which camera; frusta count over all cameras.
struct Draw {
    patch: usize,
    frustum: usize,
    camera: usize,
}

/// What one frame uploads.
struct Inputs {
    draws: Vec<Draw>,
    patches: Vec<u8>,
    frusta: Vec<u8>,
    movers: Vec<[f32; 4]>,
}

impl PointPass {
    /// Compiles the pipelines.
    pub fn new(gpu: &Gpu) -> Result<PointPass, SurfaceError> {
        let module = gpu.shader("surface/points.wgsl")?;
        let layout = bind_group_layout(gpu);
        let pipeline = |cull| pipeline(gpu, &module, &layout, cull);
        let (both_sides, front_only) = (pipeline(None), pipeline(Some(wgpu::Face::Back)));
        Ok(PointPass { gpu: gpu.clone(), layout, both_sides, front_only })
    }

    /// Clears the target and draws everything held as seen by each camera, from the pixel of the target on that stands beside
    /// it, where its image must fit; points are relative to `anchor_world`. A frustum's planes past [`FRUSTUM_PLANES`] do not bound it.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        cameras: &[(GraphCamera, [u32; 2])],
        anchor_world: DVec3,
        target: &PointBuffer,
    ) {
        let stride = self.gpu.device.limits().min_uniform_buffer_offset_alignment;
        let stride_of = |size: usize| size.next_multiple_of(stride as usize);
        let strides = [stride_of(size_of::<PatchUniform>()), stride_of(size_of::<FrustumUniform>())];
        let inputs = Inputs::new(surfaces, cameras, anchor_world, strides);
        let group = (!inputs.draws.is_empty()).then(|| self.bind(&inputs));
        let mut pass = begin(encoder, target);
        let Some(group) = group else { return };
        let patches: Vec<_> = surfaces.patches().map(|(_, patch)| patch).collect();
        for (index, draw) in inputs.draws.iter().enumerate() {
            let patch = patches[draw.patch];
            let QuadBuffers::Gpu { vertices, indices, index_count, .. } = &patch.quads else { continue };
            let (camera, [left, top]) = &cameras[draw.camera];
            let (width, height) = camera.size_px();
            pass.set_viewport(*left as f32, *top as f32, width as f32, height as f32, 0.0, 1.0);
            pass.set_pipeline(if surfaces.is_one_sided(patch) { &self.front_only } else { &self.both_sides });
            pass.set_bind_group(0, &group, &[(index * strides[0]) as u32, (draw.frustum * strides[1]) as u32]);
            pass.set_vertex_buffer(0, vertices.slice(..));
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..*index_count, 0, 0..1);
        }
    }

    fn bind(&self, inputs: &Inputs) -> wgpu::BindGroup {
        let device = &self.gpu.device;
        let uniform = |label, contents| {
            let usage = wgpu::BufferUsages::UNIFORM;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let (patches, frusta) = (uniform("patches", &inputs.patches), uniform("frusta", &inputs.frusta));
        let movers = movers_texture(&self.gpu, inputs.movers.clone());
        let movers = movers.create_view(&wgpu::TextureViewDescriptor::default());
        let part = |buffer, size: usize| {
            let size = wgpu::BufferSize::new(size as u64);
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
        };
        let resources = [
            part(&patches, size_of::<PatchUniform>()),
            wgpu::BindingResource::TextureView(&movers),
            part(&frusta, size_of::<FrustumUniform>()),
        ];
        let entries = resources.into_iter().zip(0..);
        let entries: Vec<_> = entries.map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("graph points"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

impl Inputs {
    fn new(
        surfaces: &HeldSurfaces,
        cameras: &[(GraphCamera, [u32; 2])],
        anchor_world: DVec3,
        strides: [usize; 2],
    ) -> Inputs {
        let mut inputs = Inputs { draws: Vec::new(), patches: Vec::new(), frusta: Vec::new(), movers: Vec::new() };
        let frusta = cameras
            .iter()
            .enumerate()
            .flat_map(|(place, (camera, _))| camera.frusta().iter().map(move |frustum| (place, camera, frustum)));
        for (number, (place, camera, frustum)) in frusta.enumerate() {
            let projection = Projection::new(frustum);
            let uniform = frustum_uniform(camera, frustum, &projection, anchor_world);
            push(&mut inputs.frusta, bytemuck::bytes_of(&uniform), strides[1]);
            for (index, (_, patch)) in surfaces.patches().enumerate() {
                if patch.may_reach_into(frustum.half_spaces_world()) {
                    inputs.draws.push(Draw { patch: index, frustum: number, camera: place });
                    inputs.add_patch(surfaces, patch, &projection, strides[0]);
                }
            }
        }
        inputs
    }

    fn add_patch(&mut self, surfaces: &HeldSurfaces, patch: &PatchSurface, projection: &Projection, stride: usize) {
        let placement = Placement::new(surfaces, patch, &projection.image_from_world);
        let uniform = PatchUniform {
            image_from_patch: placement.eye_from_patch,
            centre_px: patch.camera.centre_px.as_vec2().to_array(),
            focal_px: patch.camera.focal_px as f32,
            first_mover: self.movers.len() as u32 / MOVER_TEXELS,
        };
        push(&mut self.patches, bytemuck::bytes_of(&uniform), stride);
        for mover in &placement.movers {
            self.movers.extend(mover.eye_from_patch);
            self.movers.extend(mover.turn);
        }
    }
}

fn push(bytes: &mut Vec<u8>, value: &[u8], stride: usize) {
    bytes.extend(value);
    bytes.resize(bytes.len().next_multiple_of(stride), 0);
}

fn frustum_uniform(
    camera: &GraphCamera,
    frustum: &Frustum,
    projection: &Projection,
    anchor_world: DVec3,
) -> FrustumUniform {
    let matrix = projection.image_from_offset.as_dmat3();
    let offset_from_image = matrix.inverse();
    let mut planes = [[0.0, 0.0, 0.0, 1.0]; FRUSTUM_PLANES];
    for (plane, half_space) in planes.iter_mut().zip(frustum.half_spaces_world()) {
        *plane = image_plane(half_space, frustum.centre_world(), &offset_from_image).as_vec4().to_array();
    }
    // The root's near plane is the plane of its face.
    let near_w = 1.0 / camera.root().near_m;
    let (width, height) = camera.size_px();
    FrustumUniform {
        offset_from_image: gpu::columns(offset_from_image.as_mat3()),
        centre_anchor: (frustum.centre_world() - anchor_world).as_vec3().to_array(),
        near_q: (projection.w_scale / near_w) as f32,
        size_px: [width as f32, height as f32],
        padding: [0.0; 2],
        planes,
    }
}

/// How deep a point lies in a half-space, as a linear function of `(u q, v q, q, 1)`: the distance is `d - a.(X - c)`.
fn image_plane(half_space: &camera::HalfSpace, centre_world: DVec3, offset_from_image: &DMat3) -> DVec4 {
    let depth_m = half_space.depth_m(centre_world);
    (-(offset_from_image.transpose() * half_space.outward)).extend(depth_m)
}

fn begin<'a>(encoder: &'a mut wgpu::CommandEncoder, target: &PointBuffer) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("graph points"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn bind_group_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let uniform = |size: usize| wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: wgpu::BufferSize::new(size as u64),
    };
    let movers = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let both = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let entry = |(binding, (visibility, ty))| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let kinds = [
        (wgpu::ShaderStages::VERTEX, uniform(size_of::<PatchUniform>())),
        (wgpu::ShaderStages::VERTEX, movers),
        (both, uniform(size_of::<FrustumUniform>())),
    ];
    let entries: Vec<_> = (0..).zip(kinds).map(entry).collect();
    let label = Some("graph points");
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries })
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    cull_mode: Option<wgpu::Face>,
) -> wgpu::RenderPipeline {
    let label = Some("graph points");
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let attribute = |format, offset: usize, shader_location| wgpu::VertexAttribute {
        format,
        offset: offset as u64,
        shader_location,
    };
    let attributes = [
        attribute(wgpu::VertexFormat::Float32x3, std::mem::offset_of!(Vertex, u_px), 0),
        attribute(wgpu::VertexFormat::Uint32, std::mem::offset_of!(Vertex, corner_normal_mover), 1),
    ];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        primitive: wgpu::PrimitiveState { cull_mode, ..wgpu::PrimitiveState::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: PointBuffer::DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(PointBuffer::POINTS.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "surface/points.wgsl";
        shaders::assert_layout!(PatchUniform, path, "PatchView", image_from_patch, centre_px, focal_px, first_mover);
        shaders::assert_layout!(
            FrustumUniform,
            path,
            "PointFrustum",
            offset_from_image,
            centre_anchor,
            near_q,
            size_px,
            planes
        );
    }
}
