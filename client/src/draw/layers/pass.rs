use std::array;

use camera::Pinhole;
use gpu::{Gpu, PinholeUniform};
use protocol::{Held, Purpose};
use surface::{GBuffer, Smoothing, SurfaceError, SurfacePass};
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};
use crate::draw::layers::Layers;
use crate::draw::light::LightPass;
use crate::draw::lit::Lit;
use crate::draw::shares::Shares;

const LAYERS: usize = Purpose::LAYERS as usize;

/// Draws, lights and blends layers.
#[derive(Debug)]
pub(crate) struct LayersPass {
    gpu: Gpu,
    surface: SurfacePass,
    blend: FullscreenPass,
    targets: Option<Targets>,
    /// In place of a layer that is not there.
    nothing: Lit,
}

/// Layers are drawn one after the other.
#[derive(Debug)]
struct Targets {
    size_px: (u32, u32),
    gbuffer: GBuffer,
    lit: Vec<Lit>,
    over: Target,
}

/// What layers lie over, and how they are lit.
pub(crate) struct Under<'a> {
    pub held: &'a Held,
    pub camera: &'a Pinhole,
    /// The opaque surfaces.
    pub gbuffer: &'a GBuffer,
    pub smoothing: Smoothing,
    pub exposure: f32,
}

impl LayersPass {
    /// Linear light times what it hides, and that: half floats keep more than 8 bits tell apart.
    const OVER: TextureFormat = TextureFormat::Rgba16Float;

    pub(crate) fn new(gpu: &Gpu) -> Result<LayersPass, SurfaceError> {
        use Binding::{FloatTexture, Uniform};
        let mut bindings = vec![Uniform, FloatTexture];
        bindings.extend([FloatTexture; 2 * LAYERS]);
        let blend = FullscreenPass::new(gpu, "client/layers.wgsl", "blend", &bindings, &[LayersPass::OVER])?;
        let nothing = Lit::new(gpu, (1, 1));
        Ok(LayersPass { gpu: gpu.clone(), surface: SurfacePass::new(gpu)?, blend, targets: None, nothing })
    }

    /// Draws layers as `under.camera` sees them; what lies over its picture is [`LayersPass::over`] afterwards.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        layers: &Layers,
        light: &mut LightPass,
        under: &Under<'_>,
    ) {
        let size_px = (under.camera.width_px, under.camera.height_px);
        let targets = self.targets.take().filter(|targets| targets.size_px == size_px);
        let mut targets = targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        targets.lit.resize_with(layers.surfaces().len(), || Lit::new(&self.gpu, size_px));
        for (surfaces, lit) in layers.surfaces().zip(&targets.lit) {
            self.surface.encode(encoder, surfaces, under.camera, under.smoothing, &targets.gbuffer);
            let all_light = (&targets.gbuffer, Shares::default());
            light.encode(encoder, all_light, under.held, (under.camera, false), under.exposure, lit);
        }
        let camera = PinholeUniform::new(under.camera, under.camera.world_from_eye.translation);
        let camera = uniform(&self.gpu, "camera of layers", bytemuck::bytes_of(&camera));
        let lit: [&Lit; LAYERS] = array::from_fn(|layer| targets.lit.get(layer).unwrap_or(&self.nothing));
        let mut inputs = vec![camera.as_entire_binding(), BindingResource::TextureView(&under.gbuffer.views.w)];
        inputs.extend(lit.iter().flat_map(|lit| [&lit.colour.view, &lit.w.view]).map(BindingResource::TextureView));
        self.blend.encode(encoder, &inputs, &[&targets.over.view]);
        self.targets = Some(targets);
    }

    /// What lies over the picture, in linear light times what it hides, and that in alpha.
    pub(crate) fn over(&self) -> Option<&TextureView> {
        self.targets.as_ref().map(|targets| &targets.over.view)
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Targets {
        let over = Target::new(gpu, "over", size_px, LayersPass::OVER);
        Targets { size_px, gbuffer: GBuffer::new(gpu, size_px), lit: Vec::new(), over }
    }
}
