//! Which held sample each pixel of a view shows: how a server sees what a client holds.

mod gpu;
mod raster;
mod view;

use ::gpu::{Gpu, ReadbackError};
use camera::Pinhole;

use self::gpu::GpuPass;
use crate::SurfaceError;
use crate::held::HeldSurfaces;
pub use view::{AddressTexel, AddressView};

/// Draws [`AddressView`]s: on the GPU, or, where that is only software, by a rasterizer of our own, which is several
/// times faster for quads of about a pixel.
#[derive(Debug)]
pub struct AddressPass(Way);

#[derive(Debug)]
enum Way {
    Gpu(Box<GpuPass>),
    Host,
}

impl AddressPass {
    /// The faster way on this adapter.
    pub fn new(gpu: &Gpu) -> Result<AddressPass, SurfaceError> {
        if gpu.caps.software { Ok(AddressPass::on_host()) } else { AddressPass::on_gpu(gpu) }
    }

    /// On the GPU.
    pub fn on_gpu(gpu: &Gpu) -> Result<AddressPass, SurfaceError> {
        Ok(AddressPass(Way::Gpu(Box::new(GpuPass::new(gpu)?))))
    }

    /// On the processor.
    pub fn on_host() -> AddressPass {
        AddressPass(Way::Host)
    }

    /// Another one that draws the same way.
    pub fn twin(&self) -> Result<AddressPass, SurfaceError> {
        match &self.0 {
            Way::Gpu(pass) => AddressPass::on_gpu(pass.gpu()),
            Way::Host => Ok(AddressPass::on_host()),
        }
    }

    /// Surfaces of the kind that this pass draws.
    pub fn new_surfaces(&self) -> HeldSurfaces {
        match &self.0 {
            Way::Gpu(pass) => HeldSurfaces::new(pass.gpu()).at_finest_level(),
            Way::Host => HeldSurfaces::on_host(),
        }
    }

    /// Draws everything held as seen by `camera`, an [`AddressTexel`] a texel, for who reads it on the GPU: there once the encoder's commands were submitted, and until
    /// the next view. `None` where this pass draws on the processor.
    pub fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        surfaces: &HeldSurfaces,
        camera: &Pinhole,
    ) -> Option<wgpu::TextureView> {
        match &mut self.0 {
            Way::Gpu(pass) => Some(pass.draw(encoder, surfaces, camera)),
            Way::Host => None,
        }
    }

    /// Draws everything held as seen by `camera` and waits for it. `surfaces` are of [`AddressPass::new_surfaces`].
    pub fn view(&mut self, surfaces: &HeldSurfaces, camera: &Pinhole) -> Result<AddressView, ReadbackError> {
        match &mut self.0 {
            Way::Gpu(pass) => pass.view(surfaces, camera),
            Way::Host => Ok(raster::view(surfaces, camera)),
        }
    }
}
