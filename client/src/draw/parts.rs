//! A view at rest whose pixels come in parts ([`protocol::DepthImage::share`]): pictures of its images, each lit by itself, are added up in
//! linear light, each sample by the share of the pixel that it covers.

use gpu::Gpu;
use surface::GBuffer;
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::fullscreen::{self, Binding, FullscreenPass, Onto, Target};
use crate::draw::lit::Lit;

/// See the module.
#[derive(Debug)]
pub(crate) struct PartsPass {
    gpu: Gpu,
    add: FullscreenPass,
    show: FullscreenPass,
    sum: Option<Target>,
}

impl PartsPass {
    /// Half floats keep sixteenths of what 8 bits tell apart.
    const SUM: TextureFormat = TextureFormat::Rgba16Float;

    pub(crate) fn new(gpu: &Gpu, output: TextureFormat) -> Result<PartsPass, shaders::ShaderError> {
        use Binding::{FloatTexture, Uniform};
        let textures = [FloatTexture; 2];
        let add = FullscreenPass::onto(Onto::Sum, gpu, ("client/parts.wgsl", "add"), &textures, &[PartsPass::SUM])?;
        let bindings = [Uniform, FloatTexture];
        let show = FullscreenPass::new(gpu, "client/present_parts.wgsl", "show_parts", &bindings, &[output])?;
        Ok(PartsPass { gpu: gpu.clone(), add, show, sum: None })
    }

    /// Adds a picture; the first one begins anew.
    pub(crate) fn add(&mut self, encoder: &mut wgpu::CommandEncoder, lit: &Lit, gbuffer: &GBuffer, is_first: bool) {
        let sum = self.sum.take().filter(|sum| (sum.texture.width(), sum.texture.height()) == gbuffer.size_px);
        let sum = sum.unwrap_or_else(|| Target::new(&self.gpu, "parts", gbuffer.size_px, PartsPass::SUM));
        let inputs = [&lit.colour.view, &gbuffer.views.colour].map(BindingResource::TextureView);
        let mut pass = fullscreen::begin(encoder, "parts", is_first, &[&sum.view], None);
        self.add.draw(&mut pass, &inputs);
        drop(pass);
        self.sum = Some(sum);
    }

    /// Shows what was added up.
    pub(crate) fn show(&self, encoder: &mut wgpu::CommandEncoder, present: &wgpu::Buffer, output: &TextureView) {
        let Some(sum) = &self.sum else { return };
        let inputs = [present.as_entire_binding(), BindingResource::TextureView(&sum.view)];
        self.show.encode(encoder, &inputs, &[output]);
    }
}
