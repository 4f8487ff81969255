use camera::Pinhole;
use gpu::{Gpu, Readback, ReadbackError};
use wgpu::TextureFormat;

use super::view::AddressView;
use crate::SurfaceError;
use crate::gbuffer::GBuffer;
use crate::held::HeldSurfaces;
use crate::pass::{Quads, Smoothing};

/// The pass on the GPU.
#[derive(Debug)]
pub(super) struct GpuPass {
    gpu: Gpu,
    quads: Quads,
    /// Kept for the next view of the same size.
    targets: Option<Targets>,
}

#[derive(Debug)]
struct Targets {
    addresses: wgpu::Texture,
    addresses_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl GpuPass {
    /// [`super::AddressTexel`] as a texel.
    const FORMAT: TextureFormat = TextureFormat::Rgba32Uint;

    /// Compiles the pipeline.
    pub(super) fn new(gpu: &Gpu) -> Result<GpuPass, SurfaceError> {
        Ok(GpuPass {
            gpu: gpu.clone(),
            quads: Quads::new(gpu, ("vertex", "address"), &[GpuPass::FORMAT], Some(wgpu::Face::Back))?,
            targets: None,
        })
    }

    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Draws a view; the targets hold it once the encoder's commands were submitted.
    fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, surfaces: &HeldSurfaces, camera: &Pinhole) -> &Targets {
        let size_px = (camera.width_px, camera.height_px);
        let kept = self.targets.take().filter(|kept| (kept.addresses.width(), kept.addresses.height()) == size_px);
        let targets = kept.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        let views = [&targets.addresses_view];
        self.quads.encode(encoder, surfaces, camera, Smoothing::Blended, &views, &targets.depth_view);
        self.targets.insert(targets)
    }

    /// The same, for who reads it on the GPU.
    pub(super) fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
    ) -> wgpu::TextureView {
        self.encode(encoder, surfaces, camera).addresses_view.clone()
    }

    pub(super) fn view(&mut self, surfaces: &HeldSurfaces, camera: &Pinhole) -> Result<AddressView, ReadbackError> {
        let gpu = self.gpu.clone();
        let size_px = (camera.width_px, camera.height_px);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let slot = readback.texture(&self.encode(&mut encoder, surfaces, camera).addresses, 0, size_px);
        let encoded = readback.encode(&gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&gpu)?;
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
        let addresses =
            texture("addresses", GpuPass::FORMAT, wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::TEXTURE_BINDING);
        let depth = texture("depth of addresses", GBuffer::DEPTH, wgpu::TextureUsages::empty());
        Targets {
            addresses_view: addresses.create_view(&wgpu::TextureViewDescriptor::default()),
            depth_view: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            addresses,
        }
    }
}
