//! A body on the GPU: vertices, triangles, and the levels of its image.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use gpu::Gpu;
use protocol::DepthImage;
use protocol::body::{Body, Wrap};
use wgpu::BufferUsages;
use wgpu::util::DeviceExt;

/// `Vertex` of `client/body.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct BodyVertex {
    position: [u16; 4],
    normal: [u16; 2],
    uv: [u16; 2],
    colour: [u8; 4],
    bones: [u8; 4],
    shares: [u16; 4],
}

impl BodyVertex {
    pub const ATTRIBUTES: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![
        0 => Unorm16x4, 1 => Unorm16x2, 2 => Unorm16x2, 3 => Unorm8x4, 4 => Uint8x4, 5 => Unorm16x4,
    ];
}

#[derive(Debug)]
pub(super) struct Placed {
    pub body: Arc<Body>,
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub colours: wgpu::TextureView,
    pub sampler: wgpu::Sampler,
    /// Of its image.
    pub pixels: u64,
    /// Index into the table of materials.
    pub material: u8,
    /// Whether its image has gaps that nothing shows.
    pub is_cut_out: bool,
}

impl Placed {
    pub fn new(gpu: &Gpu, atlas: &DepthImage, body: Arc<Body>) -> Placed {
        let skin = body.skin.as_ref();
        let vertex = |at: usize| {
            let [x, y, z] = body.positions[at];
            let [red, green, blue] = body.colours.get(at).copied().unwrap_or([255; 3]);
            BodyVertex {
                position: [x, y, z, 0],
                normal: body.normals.get(at).copied().unwrap_or_default(),
                uv: body.uvs.get(at).copied().unwrap_or_default(),
                colour: [red, green, blue, 255],
                bones: skin.map_or([0; 4], |skin| skin.bones[at]),
                shares: skin.map_or([0; 4], |skin| skin.shares[at]),
            }
        };
        let vertices: Vec<BodyVertex> = (0..body.positions.len()).map(vertex).collect();
        let buffer = |label, contents: &[u8], usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        Placed {
            vertices: buffer("body vertices", bytemuck::cast_slice(&vertices), BufferUsages::VERTEX),
            indices: buffer("body triangles", bytemuck::cast_slice(&body.indices), BufferUsages::INDEX),
            colours: colours(gpu, atlas),
            sampler: sampler(gpu, &body),
            pixels: u64::from(atlas.mask.size_px().0) * u64::from(atlas.mask.size_px().1),
            material: atlas.material.first().copied().unwrap_or_default(),
            is_cut_out: body.cut_out,
            body,
        }
    }

    /// Whether it is another one from moment to moment.
    pub fn is_bent(&self) -> bool {
        self.body.skin.is_some()
    }
}

fn sampler(gpu: &Gpu, body: &Body) -> wgpu::Sampler {
    let mode = |wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("body colours"),
        address_mode_u: mode(body.wrap[0]),
        address_mode_v: mode(body.wrap[1]),
        mag_filter: if body.nearest { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear },
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    })
}

/// A level of the image: linear light times how much of it there is, and that.
struct Level {
    width_px: u32,
    height_px: u32,
    texels: Vec<[f32; 4]>,
}

/// The image with all its levels.
fn colours(gpu: &Gpu, atlas: &DepthImage) -> wgpu::TextureView {
    let (width_px, height_px) = atlas.mask.size_px();
    let mut texels = vec![[0.0; 4]; width_px as usize * height_px as usize];
    let linear: Vec<f32> = (0..=u8::MAX).map(linear_from_srgb).collect();
    for ((x, y), colour) in atlas.mask.occupied().zip(&atlas.colour) {
        let [red, green, blue] = colour.map(|code| linear[usize::from(code)]);
        texels[y as usize * width_px as usize + x as usize] = [red, green, blue, 1.0];
    }
    let mut levels = vec![Level { width_px, height_px, texels }];
    while let Some(finer) = levels.last().filter(|level| level.width_px.max(level.height_px) > 1) {
        let coarser = halved(finer);
        levels.push(coarser);
    }
    let bytes: Vec<u8> = levels.iter().flat_map(|level| &level.texels).flat_map(encoded).collect();
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("body colours"),
            size: wgpu::Extent3d { width: width_px, height: height_px, depth_or_array_layers: 1 },
            mip_level_count: levels.len() as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &bytes,
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn halved(finer: &Level) -> Level {
    let (width_px, height_px) = ((finer.width_px / 2).max(1), (finer.height_px / 2).max(1));
    let texel = |index: u32| {
        let (x, y) = (2 * (index % width_px), 2 * (index / width_px));
        let (right, below) = ((x + 1).min(finer.width_px - 1), (y + 1).min(finer.height_px - 1));
        let at = |x: u32, y: u32| finer.texels[(y * finer.width_px + x) as usize];
        let four = [at(x, y), at(right, y), at(x, below), at(right, below)];
        std::array::from_fn(|channel| four.iter().map(|texel| texel[channel]).sum::<f32>() / 4.0)
    };
    Level { width_px, height_px, texels: (0..width_px * height_px).map(texel).collect() }
}

fn encoded([red, green, blue, alpha]: &[f32; 4]) -> [u8; 4] {
    let [red, green, blue] = [red, green, blue].map(|&linear| {
        let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    });
    [red, green, blue, (alpha * 255.0).round() as u8]
}

fn linear_from_srgb(code: u8) -> f32 {
    let value = f32::from(code) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}
