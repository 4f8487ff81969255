//! Group 3 of the passes that ask earlier images: `server/redundancy.wgsl`.

use camera::Pinhole;
use gpu::Gpu;
use wgpu::util::DeviceExt;

use super::Redundancy;
use super::redundancy::EarlierImages;
use crate::render::{RayBuffers, RenderError, SceneRenderer, buffer_entry};
use crate::targets::IDS_FORMAT;

/// `near * w` as a texture that can be read.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// The layout, and what is bound where a test needs nothing.
#[derive(Clone)]
pub(crate) struct EarlierLayout {
    pub layout: wgpu::BindGroupLayout,
    ids: wgpu::TextureView,
    depth: wgpu::TextureView,
    rays: RayBuffers,
}

/// What earlier images hold, as array textures with a layer an image.
pub(crate) struct EarlierPlanes<'a> {
    pub cameras: &'a [Pinhole],
    /// Rays do not ask for it.
    pub ids: Option<&'a wgpu::Texture>,
    /// Only tests by surface ask for it.
    pub depth: Option<&'a wgpu::Texture>,
}

impl EarlierLayout {
    pub fn new(gpu: &Gpu, visibility: wgpu::ShaderStages) -> EarlierLayout {
        let texture = |binding, sample_type| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2Array,
                multisampled: false,
            },
            count: None,
        };
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("earlier images"),
            entries: &[
                buffer_entry(0, visibility, wgpu::BufferBindingType::Uniform),
                texture(1, wgpu::TextureSampleType::Uint),
                texture(2, wgpu::TextureSampleType::Float { filterable: false }),
                buffer_entry(3, visibility, storage),
                buffer_entry(4, visibility, storage),
            ],
        });
        let nothing = |format| layers(&array(gpu, "nothing", format, (1, 1), 1), 1);
        EarlierLayout { layout, ids: nothing(IDS_FORMAT), depth: nothing(DEPTH_FORMAT), rays: RayBuffers::empty(gpu) }
    }

    /// The group of a pass for the camera `this`; nothing is tested where `planes` has no cameras.
    pub fn group(
        &self,
        scene: &SceneRenderer,
        this: &Pinhole,
        planes: &EarlierPlanes<'_>,
        redundancy: Option<Redundancy>,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let gpu = scene.gpu();
        let contents = EarlierImages::new(this, planes.cameras, scene.anchor_world());
        let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("earlier images"),
            contents: bytemuck::bytes_of(&contents),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let count = planes.cameras.len() as u32;
        let tested = redundancy.filter(|_| count > 0);
        let needs_rays = tested.is_some_and(|redundancy| redundancy.test.needs_rays());
        let rays = if needs_rays { scene.ray_buffers()? } else { &self.rays };
        // A layer must not be read while it is drawn into, so the own one is never bound.
        let view = |texture: &wgpu::Texture| layers(texture, count);
        let ids = planes.ids.filter(|_| tested.is_some() && !needs_rays).map_or_else(|| self.ids.clone(), view);
        let depth = planes.depth.filter(|_| tested.is_some()).map_or_else(|| self.depth.clone(), view);
        let texture =
            |binding, view| wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) };
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("earlier images"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                texture(1, &ids),
                texture(2, &depth),
                wgpu::BindGroupEntry { binding: 3, resource: rays.nodes.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 4, resource: rays.triangles.as_entire_binding() },
            ],
        }))
    }
}

/// An array texture that passes read.
pub(crate) fn array(
    gpu: &Gpu,
    label: &str,
    format: wgpu::TextureFormat,
    (width, height): (u32, u32),
    layers: u32,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// The first layers of a texture.
fn layers(texture: &wgpu::Texture, count: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        base_array_layer: 0,
        array_layer_count: Some(count),
        ..Default::default()
    })
}
