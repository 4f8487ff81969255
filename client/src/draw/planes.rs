//! Images that are shown pixel by pixel, in the formats of a G-buffer.

use glam::Vec3;
use gpu::Gpu;
use protocol::DepthImage;
use protocol::image::octahedral;
use surface::GBuffer;
use wgpu::{Extent3d, TextureFormat, TextureUsages};

/// An image's planes: of the formats of [`GBuffer::colour`], whose alpha is the share of the pixel that is covered,
/// [`GBuffer::normal_ids`] and [`GBuffer::w`].
pub(crate) fn of(gpu: &Gpu, image: &DepthImage) -> [wgpu::Texture; 3] {
    let (width, height) = image.mask.size_px();
    let size = Extent3d { width, height, depth_or_array_layers: 1 };
    let Texels { colour, normal_ids, w } = Texels::of(image);
    let planes: [(TextureFormat, &[u8]); 3] = [
        (GBuffer::COLOUR, bytemuck::cast_slice(&colour)),
        (GBuffer::NORMAL_IDS, bytemuck::cast_slice(&normal_ids)),
        (GBuffer::W, bytemuck::cast_slice(&w)),
    ];
    planes.map(|(format, texels)| texture(gpu, size, format, texels))
}

/// The texels of a [`GBuffer`], row by row; zero where there is no sample.
struct Texels {
    colour: Vec<[u8; 4]>,
    normal_ids: Vec<[u32; 2]>,
    w: Vec<f32>,
}

impl Texels {
    fn of(image: &DepthImage) -> Texels {
        let (width, height) = image.mask.size_px();
        let pixels = width as usize * height as usize;
        let mut texels =
            Texels { colour: vec![[0; 4]; pixels], normal_ids: vec![[0; 2]; pixels], w: vec![0.0; pixels] };
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let at = y as usize * width as usize + x as usize;
            let [red, green, blue] = image.colour[index];
            let share = image.share.get(index).map_or(u8::MAX, |&share| of_255(share));
            texels.colour[at] = [red, green, blue, share];
            let rest = image.colour_rest.get(index).copied().unwrap_or(0);
            let ids = u32::from(image.object[index]) | u32::from(image.material[index]) << 16 | u32::from(rest) << 24;
            texels.normal_ids[at] = [pack_normal(image.normal_at(index)), ids];
            texels.w[at] = image.depth_scale.w(image.depth[index]);
        }
        texels
    }
}

/// A share in 255ths.
fn of_255(share: u8) -> u8 {
    let whole = u16::from(DepthImage::WHOLE);
    ((u16::from(share) * u16::from(u8::MAX) + whole / 2) / whole).min(u16::from(u8::MAX)) as u8
}

/// The twin of `octahedral_code_fine` in `common/octahedral.wgsl`: two signed numbers of 16 bits.
fn pack_normal(normal: Vec3) -> u32 {
    let snorm = |value: f32| (value.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16;
    let p = octahedral(normal);
    u32::from(snorm(p.x)) | u32::from(snorm(p.y)) << 16
}

/// A texture of one level with its texels.
pub(crate) fn texture(gpu: &Gpu, size: Extent3d, format: TextureFormat, texels: &[u8]) -> wgpu::Texture {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("plane of an image"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let bytes_per_row = texels.len() as u32 / size.height;
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), texels, layout, size);
    texture
}
