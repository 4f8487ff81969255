use gpu::Gpu;
use wgpu::{Extent3d, TextureFormat, TextureUsages, TextureView};

/// What the surfaces look like from the output eye, before any light.
#[derive(Debug)]
pub struct GBuffer {
    /// Width and height in pixels.
    pub size_px: (u32, u32),
    /// [`GBuffer::COLOUR`]: base colour as sRGB bytes; alpha is how much the surface hides, 1 unless it is seen through, and 0 where there is none.
    pub colour: wgpu::Texture,
    /// [`GBuffer::NORMAL_IDS`]: x an octahedral normal (16 + 16 bits, world space now), y the object, from bit 16 the
    /// material, and from bit 24 what the colour's bytes leave off ([`protocol::image::colour_quarters`]), which only views at rest have. Bit 31: the
    /// surface says that it ends beside the sample that shows here.
    pub normal_ids: wgpu::Texture,
    /// [`GBuffer::W`]: inverse depth `1/z` in 1/m; 0 where there is no surface.
    pub w: wgpu::Texture,
    /// [`GBuffer::DEPTH`]: `near * w`, nearer is larger.
    pub depth: wgpu::Texture,
    /// Views of the four.
    pub views: GBufferViews,
}

/// See [`GBuffer`].
#[derive(Debug, Clone)]
pub struct GBufferViews {
    /// Of `colour`.
    pub colour: TextureView,
    /// Of `normal_ids`.
    pub normal_ids: TextureView,
    /// Of `w`.
    pub w: TextureView,
    /// Of `depth`.
    pub depth: TextureView,
}

impl GBuffer {
    /// See [`GBuffer::colour`].
    pub const COLOUR: TextureFormat = TextureFormat::Rgba8Unorm;
    /// See [`GBuffer::normal_ids`].
    pub const NORMAL_IDS: TextureFormat = TextureFormat::Rg32Uint;
    /// See [`GBuffer::w`].
    pub const W: TextureFormat = TextureFormat::R32Float;
    /// See [`GBuffer::depth`].
    pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

    /// Targets of one size; both sides above zero.
    pub fn new(gpu: &Gpu, size_px: (u32, u32)) -> GBuffer {
        let colour = texture(gpu, "surface colour", size_px, GBuffer::COLOUR);
        let normal_ids = texture(gpu, "surface normal and ids", size_px, GBuffer::NORMAL_IDS);
        let w = texture(gpu, "surface w", size_px, GBuffer::W);
        let depth = texture(gpu, "surface depth", size_px, GBuffer::DEPTH);
        let views = GBufferViews {
            colour: colour.create_view(&wgpu::TextureViewDescriptor::default()),
            normal_ids: normal_ids.create_view(&wgpu::TextureViewDescriptor::default()),
            w: w.create_view(&wgpu::TextureViewDescriptor::default()),
            depth: depth.create_view(&wgpu::TextureViewDescriptor::default()),
        };
        GBuffer { size_px, colour, normal_ids, w, depth, views }
    }

    /// Targets of the same size of which only `w` is new: for views of which nothing else is kept, a fifth of the memory.
    pub fn beside(&self, gpu: &Gpu) -> GBuffer {
        let w = texture(gpu, "surface w", self.size_px, GBuffer::W);
        let views = GBufferViews { w: w.create_view(&wgpu::TextureViewDescriptor::default()), ..self.views.clone() };
        let (colour, normal_ids, depth) = (self.colour.clone(), self.normal_ids.clone(), self.depth.clone());
        GBuffer { size_px: self.size_px, colour, normal_ids, w, depth, views }
    }
}

/// Drawn, read by what comes after, copied out, and copied into.
const USAGE: TextureUsages = TextureUsages::RENDER_ATTACHMENT
    .union(TextureUsages::TEXTURE_BINDING)
    .union(TextureUsages::COPY_SRC)
    .union(TextureUsages::COPY_DST);

fn texture(gpu: &Gpu, label: &str, (width, height): (u32, u32), format: TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: USAGE,
        view_formats: &[],
    })
}
