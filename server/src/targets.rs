//! The targets that the scene is rasterized into: ids, colour, what their codes leave off, and depth, one array layer an image.

use gpu::{Gpu, Mapped, Readback, Slot};

use crate::render::DEPTH_FORMAT;

/// Two words a pixel.
pub(crate) const IDS_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Colour is encoded by the shader: the bytes are the values.
const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// [`protocol::DepthImage::normal_rest`] and [`protocol::DepthImage::colour_rest`].
const RESTS_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg8Uint;
/// Of what is drawn into [`Attachments`].
pub(crate) const FORMATS: [wgpu::TextureFormat; 3] = [IDS_FORMAT, COLOUR_FORMAT, RESTS_FORMAT];

/// Textures of one size with a layer for each image. Images may be smaller: they use the top left corner.
#[derive(Debug)]
pub(crate) struct Attachments {
    pub size_px: (u32, u32),
    pub layers: u32,
    pub ids: wgpu::Texture,
    colour: wgpu::Texture,
    rests: wgpu::Texture,
    depth: wgpu::Texture,
}

/// Where one image's planes come back.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slots {
    ids: Slot,
    colour: Slot,
    rests: Slot,
    depth: Slot,
    size_px: (u32, u32),
}

impl Attachments {
    pub(crate) fn new(gpu: &Gpu, size_px: (u32, u32), layers: u32) -> Attachments {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = |label, format| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        Attachments {
            size_px,
            layers,
            ids: texture("ids", IDS_FORMAT),
            colour: texture("colour", COLOUR_FORMAT),
            rests: texture("rests", RESTS_FORMAT),
            depth: texture("depth", DEPTH_FORMAT),
        }
    }

    /// Whether images of a size fit, and take up enough of it: what is not asked for is read back too.
    pub(crate) fn holds(&self, (width, height): (u32, u32), layers: u32) -> bool {
        let pixels = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
        let fits = width <= self.size_px.0 && height <= self.size_px.1 && layers <= self.layers;
        fits && pixels((width, height)) * u64::from(layers) * 2 > pixels(self.size_px) * u64::from(self.layers)
    }

    /// A layer's ids, colour, rests and depth.
    pub(crate) fn views(&self, layer: u32) -> [wgpu::TextureView; 4] {
        [&self.ids, &self.colour, &self.rests, &self.depth].map(|texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        })
    }

    /// A pass into a layer, cleared: no ids, no depth, `background` with alpha 0.
    pub(crate) fn begin<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        layer: u32,
        background: [f64; 3],
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'a> {
        let [ids, colour, rests, depth] = self.views(layer);
        let target = |view, clear| {
            let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        let [r, g, b] = background;
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[
                target(&ids, wgpu::Color::TRANSPARENT),
                target(&colour, wgpu::Color { r, g, b, a: 0.0 }),
                target(&rests, wgpu::Color::TRANSPARENT),
            ],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes,
            ..Default::default()
        })
    }

    /// Copies a layer's depth into the same layer of a texture of the same size that passes can read.
    pub(crate) fn copy_depth(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, layer: u32, to: &wgpu::Texture) {
        let (width, height) = self.size_px;
        let bytes_per_row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("depth on its way"),
            size: u64::from(bytes_per_row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: Some(height) };
        let between = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        let layer_of = |texture, aspect| wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
            aspect,
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        encoder.copy_texture_to_buffer(layer_of(&self.depth, wgpu::TextureAspect::DepthOnly), between, size);
        encoder.copy_buffer_to_texture(between, layer_of(to, wgpu::TextureAspect::All), size);
    }

    /// Reads the top left `size_px` of a layer. Depth can only be copied whole: [`planes`] crops it.
    pub(crate) fn read(&self, readback: &mut Readback, layer: u32, size_px: (u32, u32)) -> Slots {
        Slots {
            ids: readback.texture(&self.ids, layer, size_px),
            colour: readback.texture(&self.colour, layer, size_px),
            rests: readback.texture(&self.rests, layer, size_px),
            depth: readback.texture(&self.depth, layer, self.size_px),
            size_px,
        }
    }
}

/// The planes of an image as they come from the GPU, row-major.
pub(crate) struct Planes {
    pub ids: Vec<[u32; 2]>,
    pub colour: Vec<[u8; 4]>,
    pub rests: Vec<[u8; 2]>,
    pub depth: Vec<f32>,
}

/// The planes of an image that was read.
pub(crate) fn planes(mapped: &Mapped, slots: Slots) -> Planes {
    let (width, height) = (slots.size_px.0 as usize, slots.size_px.1 as usize);
    let mut depth = Vec::with_capacity(width * height);
    for row in mapped.rows(slots.depth).take(height) {
        gpu::readback::extend_from_bytes(&mut depth, &row[..width * 4]);
    }
    Planes {
        ids: mapped.values(slots.ids),
        colour: mapped.values(slots.colour),
        rests: mapped.values(slots.rests),
        depth,
    }
}
