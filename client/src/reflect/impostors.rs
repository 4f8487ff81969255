//! Impostors on the GPU.

use std::collections::BTreeMap;

use camera::{Bounds, Camera};
use glam::{DAffine3, DVec3};
use gpu::uniforms::columns;
use gpu::{Gpu, PinholeUniform};
use impostor::{FRUSTUM_TEXELS, Impostor, ImpostorError, ImpostorUniform};
use thiserror::Error;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, TextureFormat, TextureView};

use super::averages::{ColourTexels, colour_texels};
use super::uniforms::PlacedUniform;
use super::{FULL_FACING_DEG, ImpostorImage, ImpostorKind, Search, Settings};
use crate::fullscreen::uniform;

/// Why an image is no impostor. All are faults of who made it.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
pub enum ReflectError {
    /// Samples and camera do not fit.
    #[error(transparent)]
    Impostor(#[from] ImpostorError),
    /// Not one colour for each pixel.
    #[error("{colours} colours for {samples} samples")]
    Colours {
        /// How many there are.
        colours: usize,
        /// How many there should be.
        samples: usize,
    },
    /// A texture of it would be larger than the GPU takes.
    #[error("an impostor needs textures {need_px} texels wide, and the GPU has {limit_px}")]
    TooLarge {
        /// The longest side.
        need_px: u32,
        /// The device's limit.
        limit_px: u32,
    },
    /// With it, impostors would have more pixels together than a client holds.
    #[error("impostors of {pixels} pixels are more than are held")]
    TooMany {
        /// How many there would be.
        pixels: u64,
    },
    /// A frustum of its graph camera has more planes than a shader reads.
    #[error("a frustum of the impostor's camera has too many planes")]
    Planes,
}

/// The impostors that rays of a picture are intersected with.
#[derive(Debug)]
pub struct Impostors {
    gpu: Gpu,
    placed: BTreeMap<u64, Placed>,
}

impl Impostors {
    /// None yet.
    pub fn new(gpu: &Gpu) -> Impostors {
        Impostors { gpu: gpu.clone(), placed: BTreeMap::new() }
    }

    /// Puts one up, in place of what was there by this id. An image without any sample leaves nothing there.
    ///
    /// # Errors
    /// Where the image is none; then what was there by this id stays.
    pub fn insert(&mut self, id: u64, image: &ImpostorImage) -> Result<(), ReflectError> {
        match Placed::new(&self.gpu, image)? {
            Some(placed) => self.placed.insert(id, placed),
            None => self.placed.remove(&id),
        };
        Ok(())
    }

    /// Takes one away, if it is there.
    pub fn remove(&mut self, id: u64) {
        self.placed.remove(&id);
    }

    /// Takes all away.
    pub fn clear(&mut self) {
        self.placed.clear();
    }

    /// Pixels of all of them.
    pub(crate) fn pixels(&self) -> u64 {
        self.placed.values().map(|placed| placed.pixels).sum()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    pub(crate) fn placed(&self) -> impl Iterator<Item = &Placed> {
        self.placed.values()
    }
}

/// One of them. Its textures are relative to `anchor_world`, at capture: a moving eye or object changes one small uniform.
#[derive(Debug)]
pub(crate) struct Placed {
    pub kind: ImpostorKind,
    pose: Option<(u16, DAffine3)>,
    /// In world space at capture.
    anchor_world: DVec3,
    image: ImpostorUniform,
    pub camera: PlacedCamera,
    /// Planes, ranges, shapes and colours, in the order of the shaders' bindings.
    textures: [TextureView; 4],
    pixels: u64,
    middle_m: f32,
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
    fn new(gpu: &Gpu, image: &ImpostorImage) -> Result<Option<Placed>, ReflectError> {
        let (samples, colours) = (image.samples.len(), image.colour.len());
        if samples != colours {
            return Err(ReflectError::Colours { colours, samples });
        }
        let size_px = image.camera.size_px();
        let side_px = size_px.0.max(size_px.1).checked_next_power_of_two().unwrap_or(u32::MAX);
        // Of ranges and colours: the pixels, and half of it for all blocks.
        let (need_px, limit_px) = (side_px.saturating_add(side_px / 2), gpu.device.limits().max_texture_dimension_2d);
        if need_px > limit_px {
            return Err(ReflectError::TooLarge { need_px, limit_px });
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

    /// The uniforms of this frame: where it is, and what it is.
    pub fn uniforms(
        &self,
        gpu: &Gpu,
        eye_world: DVec3,
        poses_now: &BTreeMap<u16, DAffine3>,
        settings: Settings,
    ) -> [wgpu::Buffer; 2] {
        // What has no pose now has not moved.
        let pose_now = self.pose.and_then(|(object, at_capture)| Some((at_capture, *poses_now.get(&object)?)));
        let capture_from_now = pose_now.map_or(DAffine3::IDENTITY, |(at_capture, now)| at_capture * now.inverse());
        let (kind, object) = match self.kind {
            ImpostorKind::Object(object) => (0, u32::from(object) + 1),
            ImpostorKind::Environment => (1, 0),
            ImpostorKind::Inside(object) => (2, u32::from(object) + 1),
        };
        let placed = PlacedUniform {
            capture_from_now: columns(capture_from_now.matrix3.as_mat3()),
            eye_anchor: (capture_from_now.transform_point3(eye_world) - self.anchor_world).as_vec3().to_array(),
            kind,
            object,
            full_facing: if self.fades(settings) { FULL_FACING_DEG.to_radians().sin() as f32 } else { 0.0 },
            filtered: u32::from(settings.filter),
            middle_m: self.middle_m,
        };
        let image = ImpostorUniform { fine_px: settings.search.fine_px(), ..self.image };
        [uniform(gpu, "placed", bytemuck::bytes_of(&placed)), uniform(gpu, "impostor", bytemuck::bytes_of(&image))]
    }

    /// Whether some of its samples may count in part.
    pub fn fades(&self, settings: Settings) -> bool {
        let is_object = matches!(self.kind, ImpostorKind::Object(_));
        settings.fade && is_object && matches!(self.camera, PlacedCamera::Spoc(_))
    }

    pub fn textures(&self) -> [BindingResource<'_>; 4] {
        self.textures.each_ref().map(BindingResource::TextureView)
    }

    /// Whether directions alone look it up.
    pub fn is_map(&self, search: Search) -> bool {
        let is_walked = matches!(self.kind, ImpostorKind::Inside(_)) || matches!(self.camera, PlacedCamera::Graph(_));
        search == Search::EnvironmentMap && !is_walked
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

fn placed_camera(gpu: &Gpu, impostor: &Impostor, anchor_world: DVec3) -> Result<PlacedCamera, ReflectError> {
    let pinhole = |camera| {
        let contents = PinholeUniform::new(camera, anchor_world);
        uniform(gpu, "impostor camera", bytemuck::bytes_of(&contents))
    };
    Ok(match impostor.camera() {
        Camera::Pinhole(camera) => PlacedCamera::Pinhole(pinhole(camera)),
        Camera::Spoc(camera) => PlacedCamera::Spoc(pinhole(&camera.pinhole)),
        Camera::Graph(_) => {
            let frusta = impostor.frustum_texels(anchor_world).ok_or(ReflectError::Planes)?;
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
