//! One impostor on the GPU.

use camera::{Bounds, Camera};
use glam::{DAffine3, DVec3};
use gpu::{Gpu, PinholeUniform};
use impostor::{FRUSTUM_TEXELS, Impostor, ImpostorUniform};
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, TextureFormat, TextureView};

use super::averages::{ColourTexels, colour_texels};
use super::image::{ImpostorImage, ImpostorKind, UnfitImage};
use crate::draw::fullscreen::uniform;

/// See the module.
#[derive(Debug)]
pub(crate) struct Placed {
    pub kind: ImpostorKind,
    /// See [`ImpostorImage::pose`].
    pub pose: Option<(u16, DAffine3)>,
    /// What its textures are relative to, in world space at capture.
    pub anchor_world: DVec3,
    image: ImpostorUniform,
    pub camera: PlacedCamera,
    /// Planes, ranges, shapes and colours, in the order of the shaders' bindings.
    textures: [TextureView; 4],
    pub pixels: u64,
    /// How far from the anchor its middle is, or half of its extent where that is more, metres.
    pub middle_m: f32,
}

#[derive(Debug)]
pub(crate) enum PlacedCamera {
    Pinhole(wgpu::Buffer),
    Spoc(wgpu::Buffer),
    Graph(TextureView),
}

impl PlacedCamera {
    pub fn binding(&self) -> BindingResource<'_> {
        match self {
            PlacedCamera::Pinhole(buffer) | PlacedCamera::Spoc(buffer) => buffer.as_entire_binding(),
            PlacedCamera::Graph(frusta) => BindingResource::TextureView(frusta),
        }
    }
}

impl Placed {
    /// `None` of an image without any sample.
    pub fn new(gpu: &Gpu, image: &ImpostorImage) -> Result<Option<Placed>, UnfitImage> {
        let (samples, colours) = (image.samples.len(), image.colour.len());
        if samples != colours {
            return Err(UnfitImage::Colours { colours, samples });
        }
        let size_px = image.camera.size_px();
        let side_px = size_px.0.max(size_px.1).checked_next_power_of_two().unwrap_or(u32::MAX);
        // Of ranges and colours: the pixels, and half of it for all blocks.
        let (need_px, limit_px) = (side_px.saturating_add(side_px / 2), gpu.device.limits().max_texture_dimension_2d);
        if need_px > limit_px {
            return Err(UnfitImage::TooLarge { need_px, limit_px });
        }
        let impostor = Impostor::new(image.camera.clone(), &image.samples)?;
        let Some(bounds) = impostor.bounds_world() else { return Ok(None) };
        let anchor_world = anchor(&image.camera, &bounds);
        let Some(uniform) = impostor.uniform(anchor_world, 1.0) else { return Ok(None) };
        Ok(Some(Placed {
            kind: image.kind,
            pose: image.pose,
            anchor_world,
            image: uniform,
            camera: placed_camera(gpu, &impostor, anchor_world)?,
            textures: textures(gpu, &impostor, image),
            pixels: samples as u64,
            middle_m: bounds.middle().distance(anchor_world).max(bounds.min.distance(bounds.max) / 2.0) as f32,
        }))
    }

    /// What a ray's walk in it reads, with fine steps of `fine_px` at most.
    pub fn walked_by(&self, fine_px: f32) -> ImpostorUniform {
        ImpostorUniform { fine_px, ..self.image }
    }

    /// A box around its samples, relative to the anchor, metres, world axes at capture: as the GPU has it.
    pub fn bounds_anchor(&self) -> Bounds {
        let corner = |corner: [f32; 3]| DVec3::from(corner.map(f64::from));
        Bounds { min: corner(self.image.bounds_min_anchor), max: corner(self.image.bounds_max_anchor) }
    }

    /// Planes, ranges, shapes and colours.
    pub fn textures(&self) -> [BindingResource<'_>; 4] {
        self.textures.each_ref().map(BindingResource::TextureView)
    }
}

/// Where its samples are nearest to, so that f32 tells them apart: the eye, or the middle of what has many.
fn anchor(camera: &Camera, bounds: &Bounds) -> DVec3 {
    match camera {
        Camera::Pinhole(camera) => camera.world_from_eye.translation,
        Camera::Spoc(camera) => camera.pinhole.world_from_eye.translation,
        Camera::Graph(_) => bounds.middle(),
    }
}

fn placed_camera(gpu: &Gpu, impostor: &Impostor, anchor_world: DVec3) -> Result<PlacedCamera, UnfitImage> {
    let pinhole = |camera| {
        let contents = PinholeUniform::new(camera, anchor_world);
        uniform(gpu, "impostor camera", bytemuck::bytes_of(&contents))
    };
    Ok(match impostor.camera() {
        Camera::Pinhole(camera) => PlacedCamera::Pinhole(pinhole(camera)),
        Camera::Spoc(camera) => PlacedCamera::Spoc(pinhole(&camera.pinhole)),
        Camera::Graph(_) => {
            let frusta = impostor.frustum_texels(anchor_world).ok_or(UnfitImage::Planes)?;
            let size = (FRUSTUM_TEXELS as u32, (frusta.len() / FRUSTUM_TEXELS) as u32);
            PlacedCamera::Graph(texture(gpu, size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&frusta)))
        }
    })
}

fn textures(gpu: &Gpu, impostor: &Impostor, image: &ImpostorImage) -> [TextureView; 4] {
    let size_px = image.camera.size_px();
    let planes = impostor.plane_texels();
    let ranges = impostor.range_texels();
    let shapes = shape_texels(impostor, image);
    let is_held = planes.iter().map(|plane| plane[0] > 0.0);
    let ColourTexels { width, height, colours } = colour_texels(size_px, &image.colour, is_held);
    [
        texture(gpu, size_px, TextureFormat::Rgba32Float, bytemuck::cast_slice(&planes)),
        texture(gpu, (ranges.width, ranges.height), TextureFormat::Rg32Float, bytemuck::cast_slice(&ranges.ranges)),
        texture(gpu, size_px, TextureFormat::Rg32Uint, bytemuck::cast_slice(&shapes)),
        texture(gpu, (width, height), TextureFormat::Rgba8Unorm, bytemuck::cast_slice(&colours)),
    ]
}

/// The normal as an octahedral code of 16 + 16 bits; the upper half of the width in metres, and facing in 16 bits.
fn shape_texels(impostor: &Impostor, image: &ImpostorImage) -> Vec<[u32; 2]> {
    let shape = |(shape, sample): (impostor::SampleShape, &impostor::Sample)| {
        let width = (shape.footprint_m as f32).to_bits() & 0xffff_0000;
        [octahedral_code_fine(sample.normal_world), width | (shape.facing * 65535.0).round() as u32]
    };
    impostor.sample_shapes().zip(&image.samples).map(shape).collect()
}

/// The twin of `octahedral_code_fine` of `common/octahedral.wgsl`.
fn octahedral_code_fine(normal: DVec3) -> u32 {
    let p = normal / normal.abs().element_sum();
    if !p.is_finite() {
        return 0;
    }
    let fold = |a: f64, b: f64| (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if p.z < 0.0 { (fold(p.x, p.y), fold(p.y, p.x)) } else { (p.x, p.y) };
    let [low, high] = [x, y].map(|value| u32::from((value * 32767.0).round() as i16 as u16));
    low | high << 16
}

fn texture(gpu: &Gpu, (width, height): (u32, u32), format: TextureFormat, texels: &[u8]) -> TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("impostor"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, texels);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
