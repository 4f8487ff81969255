//! A view at rest whose pixels come in parts ([`protocol::DepthImage::share`]): pictures of its images, each lit by itself, are added up in
//! linear light, each sample by the share of the pixel that it covers.

use gpu::Gpu;
use surface::GBuffer;
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::fullscreen::{self, Binding, FullscreenPass, Onto, Target};
use crate::draw::layers::Over;
use crate::draw::lit::Lit;

/// See the module.
#[derive(Debug)]
pub(crate) struct PartsPass {
    gpu: Gpu,
    add: FullscreenPass,
    show: FullscreenPass,
    /// Made when a view at rest is first seen through something.
    through: Option<Through>,
    output: TextureFormat,
    sum: Option<Target>,
}

/// The same of what is seen through something.
#[derive(Debug)]
struct Through {
    add: FullscreenPass,
    show: FullscreenPass,
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
        Ok(PartsPass { gpu: gpu.clone(), add, show, through: None, output, sum: None })
    }

    /// Makes ready for pictures that are seen through something.
    pub(crate) fn prepare_through(&mut self) -> Result<(), shaders::ShaderError> {
        use Binding::{FloatTexture, Uniform};
        if self.through.is_none() {
            let (gpu, bindings) = (&self.gpu, [Uniform, FloatTexture, FloatTexture, FloatTexture]);
            let program = ("client/parts.wgsl", "add_through");
            let add = FullscreenPass::onto(Onto::Sum, gpu, program, &[FloatTexture; 4], &[PartsPass::SUM])?;
            let path = "client/present_parts.wgsl";
            let show = FullscreenPass::new(gpu, path, "show_parts_through", &bindings, &[self.output])?;
            self.through = Some(Through { add, show });
        }
        Ok(())
    }

    /// Adds a picture, as it is seen through what lies over it; the first one begins anew.
    pub(crate) fn add(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (lit, gbuffer, over): (&Lit, &GBuffer, Option<&Over>),
        is_first: bool,
    ) {
        let sum = self.sum.take().filter(|sum| (sum.texture.width(), sum.texture.height()) == gbuffer.size_px);
        let sum = sum.unwrap_or_else(|| Target::new(&self.gpu, "parts", gbuffer.size_px, PartsPass::SUM));
        let mut inputs = [&lit.colour.view, &gbuffer.views.colour].map(BindingResource::TextureView).to_vec();
        let mut pass = fullscreen::begin(encoder, "parts", is_first, &[&sum.view], None);
        match self.through.as_ref().zip(over) {
            Some((through, over)) => {
                inputs.extend(over.inputs());
                through.add.draw(&mut pass, &inputs);
            }
            None => self.add.draw(&mut pass, &inputs),
        }
        drop(pass);
        self.sum = Some(sum);
    }

    /// Shows what was added up, and where it is open the background, as it is seen through what lies over that.
    pub(crate) fn show(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (present, over): (&wgpu::Buffer, Option<&Over>),
        output: &TextureView,
    ) {
        let Some(sum) = &self.sum else { return };
        let mut inputs = vec![present.as_entire_binding(), BindingResource::TextureView(&sum.view)];
        match self.through.as_ref().zip(over) {
            Some((through, over)) => {
                inputs.extend(over.inputs());
                through.show.encode(encoder, &inputs, &[output]);
            }
            None => self.show.encode(encoder, &inputs, &[output]),
        }
    }
}
