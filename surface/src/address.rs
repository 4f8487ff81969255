use camera::Pinhole;
use gpu::{Gpu, Readback, ReadbackError};
use protocol::PatchId;
use wgpu::TextureFormat;

use crate::SurfaceError;
use crate::gbuffer::GBuffer;
use crate::held::HeldSurfaces;
use crate::pass::{Quads, Smoothing};

/// Draws which held sample each pixel of a view shows: how a server sees what a client holds.
#[derive(Debug)]
pub struct AddressPass {
    gpu: Gpu,
    quads: Quads,
    /// Kept for the next view of the same size.
    targets: Option<Targets>,
}

/// A pixel of an [`AddressView`], as the shader writes it; all zero where nothing is held.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct AddressTexel {
    /// [`PatchId`], from 1.
    pub patch: u32,
    /// The sample's pixel in its patch: x in the low half, y in the high one.
    pub pixel: u32,
    /// Octahedral normal in world space now in the low half (8 + 8 bits), object in the high one.
    pub normal_object: u32,
    /// Bits of the f32 inverse depth `1/z` in 1/m of the surface at the pixel's centre.
    pub w_bits: u32,
}

impl AddressTexel {
    /// The patch and the sample's `(x, y)` in it; `None` where nothing is held.
    pub fn address(&self) -> Option<(PatchId, u16, u16)> {
        (self.patch != 0).then_some((PatchId(self.patch), self.pixel as u16, (self.pixel >> 16) as u16))
    }

    /// The object.
    pub fn object(&self) -> u16 {
        (self.normal_object >> 16) as u16
    }

    /// Octahedral code of the surface's normal, in world space now.
    pub fn normal_code(&self) -> [u8; 2] {
        (self.normal_object as u16).to_le_bytes()
    }

    /// Inverse depth of the surface, 1/m; 0 where nothing is held.
    pub fn w(&self) -> f32 {
        f32::from_bits(self.w_bits)
    }
}

/// What a view shows of what is held, row-major.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AddressView {
    /// Width and height.
    pub size_px: (u32, u32),
    /// One a pixel.
    pub texels: Vec<AddressTexel>,
}

impl AddressView {
    /// Nothing is held.
    pub fn empty(size_px: (u32, u32)) -> AddressView {
        AddressView { size_px, texels: vec![AddressTexel::default(); size_px.0 as usize * size_px.1 as usize] }
    }
}

#[derive(Debug)]
struct Targets {
    addresses: wgpu::Texture,
    addresses_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl AddressPass {
    /// [`AddressTexel`] as a texel.
    const FORMAT: TextureFormat = TextureFormat::Rgba32Uint;

    /// Compiles the pipeline.
    pub fn new(gpu: &Gpu) -> Result<AddressPass, SurfaceError> {
        Ok(AddressPass { gpu: gpu.clone(), quads: Quads::new(gpu, "address", &[AddressPass::FORMAT])?, targets: None })
    }

    /// Draws everything held as seen by `camera` and waits for it.
    pub fn view(&mut self, surfaces: &HeldSurfaces, camera: &Pinhole) -> Result<AddressView, ReadbackError> {
        let size_px = (camera.width_px, camera.height_px);
        let kept = self.targets.take().filter(|kept| (kept.addresses.width(), kept.addresses.height()) == size_px);
        let targets = kept.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let views = [&targets.addresses_view];
        self.quads.encode(&mut encoder, surfaces, camera, Smoothing::Blended, &views, &targets.depth_view);
        let mut readback = Readback::default();
        let slot = readback.texture(&targets.addresses, 0, size_px);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        self.targets = Some(targets);
        Ok(AddressView { size_px, texels: mapped.values(slot) })
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Targets {
        let texture = |label, format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let addresses = texture("addresses", AddressPass::FORMAT, wgpu::TextureUsages::COPY_SRC);
        let depth = texture("depth of addresses", GBuffer::DEPTH, wgpu::TextureUsages::empty());
        Targets {
            addresses_view: addresses.create_view(&wgpu::TextureViewDescriptor::default()),
            depth_view: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            addresses,
        }
    }
}
