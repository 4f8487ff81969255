//! What it takes to see through what is blended: its layers, and a way to show them over the picture.

use camera::Pinhole;
use gpu::Gpu;
use surface::{GBuffer, SurfaceError};
use wgpu::TextureFormat;

use crate::draw::fill::LEVELS;
use crate::draw::fullscreen::{Binding, FullscreenPass};
use crate::draw::layers::{LayersPass, Over};

/// See the module.
#[derive(Debug)]
pub(crate) struct Through {
    pub(crate) layers: LayersPass,
    pub(crate) present: FullscreenPass,
}

impl Through {
    pub(crate) fn new(gpu: &Gpu, output: TextureFormat) -> Result<Through, SurfaceError> {
        let mut bindings = present_bindings();
        bindings.extend([Binding::FloatTexture; 2]);
        let present = FullscreenPass::new(gpu, "client/present.wgsl", "show_through", &bindings, &[output])?;
        Ok(Through { layers: LayersPass::new(gpu)?, present })
    }

    /// What lies over opaque surfaces, or over the background.
    pub(crate) fn over(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Pinhole,
        opaque: Option<&GBuffer>,
    ) -> Option<&Over> {
        self.layers.over(encoder, camera, opaque.map(|gbuffer| &gbuffer.views.w))
    }
}

/// Of `show` of `client/present.wgsl`.
pub(crate) fn present_bindings() -> Vec<Binding> {
    let mut bindings = vec![Binding::Uniform, Binding::FloatTexture];
    bindings.extend([Binding::FloatTexture; 2 * LEVELS]);
    bindings
}
