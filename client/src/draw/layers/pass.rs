use std::array;

use camera::Pinhole;
use gpu::{Gpu, PinholeUniform};
use protocol::{Held, Purpose};
use surface::{GBuffer, Smoothing, SurfaceError, SurfacePass};
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};
use crate::draw::layers::Layers;
use crate::draw::light::LightPass;
use crate::draw::lit::LitLayer;

const LAYERS: usize = Purpose::LAYERS as usize;

/// Draws and lights layers, and blends them with what lies behind.
#[derive(Debug)]
pub(crate) struct LayersPass {
    gpu: Gpu,
    surface: SurfacePass,
    blend: FullscreenPass,
    targets: Option<Targets>,
    /// In place of a layer, or of opaque surfaces, that are not there.
    nothing: LitLayer,
}

/// Layers are drawn one after the other.
#[derive(Debug)]
struct Targets {
    size_px: (u32, u32),
    gbuffer: GBuffer,
    lit: Vec<LitLayer>,
    over: Over,
}

/// What lies over a picture: linear light, and the share of what lies behind it that is seen.
#[derive(Debug)]
pub(crate) struct Over {
    pub(crate) light: Target,
    pub(crate) through: Target,
}

/// How layers are seen and lit.
pub(crate) struct Seen<'a> {
    pub held: &'a Held,
    pub camera: &'a Pinhole,
    pub smoothing: Smoothing,
    pub exposure: f32,
}

impl LayersPass {
    /// Half floats keep more than 8 bits tell apart.
    const OVER: TextureFormat = TextureFormat::Rgba16Float;

    pub(crate) fn new(gpu: &Gpu) -> Result<LayersPass, SurfaceError> {
        use Binding::{FloatTexture, Uniform};
        let mut bindings = vec![Uniform, FloatTexture];
        bindings.extend([FloatTexture; 3 * LAYERS]);
        let blend = FullscreenPass::new(gpu, "client/layers.wgsl", "blend", &bindings, &[LayersPass::OVER; 2])?;
        let nothing = LitLayer::new(gpu, (1, 1));
        Ok(LayersPass { gpu: gpu.clone(), surface: SurfacePass::new(gpu)?, blend, targets: None, nothing })
    }

    /// Draws and lights layers as a camera sees them.
    pub(crate) fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        layers: &Layers,
        light: &mut LightPass,
        Seen { held, camera, smoothing, exposure }: &Seen<'_>,
    ) {
        let size_px = (camera.width_px, camera.height_px);
        let targets = self.targets.take().filter(|targets| targets.size_px == size_px);
        let mut targets = targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        targets.lit.resize_with(layers.surfaces().len(), || LitLayer::new(&self.gpu, size_px));
        for (surfaces, lit) in layers.surfaces().zip(&targets.lit) {
            self.surface.encode(encoder, surfaces, camera, *smoothing, &targets.gbuffer);
            light.encode_layer(encoder, &targets.gbuffer, (held, camera), *exposure, lit);
        }
        self.targets = Some(targets);
    }

    /// What of the layers drawn last lies over opaque surfaces, by their inverse depth as the same camera sees them, with as many pixels or a whole share of
    /// them; `None`: over the background.
    pub(crate) fn over(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Pinhole,
        opaque_w: Option<&TextureView>,
    ) -> Option<&Over> {
        let targets = self.targets.as_ref()?;
        let camera = PinholeUniform::new(camera, camera.world_from_eye.translation);
        let camera = uniform(&self.gpu, "camera of layers", bytemuck::bytes_of(&camera));
        let opaque_w = opaque_w.unwrap_or(&self.nothing.lit.w.view);
        let lit: [&LitLayer; LAYERS] = array::from_fn(|layer| targets.lit.get(layer).unwrap_or(&self.nothing));
        let mut inputs = vec![camera.as_entire_binding(), BindingResource::TextureView(opaque_w)];
        let planes =
            |layer: &&'_ LitLayer| [&layer.lit.colour.view, &layer.lit.w.view, &layer.through.view].map(Clone::clone);
        let planes: Vec<TextureView> = lit.iter().flat_map(planes).collect();
        inputs.extend(planes.iter().map(BindingResource::TextureView));
        self.blend.encode(encoder, &inputs, &[&targets.over.light.view, &targets.over.through.view]);
        Some(&targets.over)
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Targets {
        let target = |label| Target::new(gpu, label, size_px, LayersPass::OVER);
        let over = Over { light: target("light over"), through: target("seen through") };
        Targets { size_px, gbuffer: GBuffer::new(gpu, size_px), lit: Vec::new(), over }
    }
}

impl Over {
    /// Both, as shaders read them.
    pub(crate) fn inputs(&self) -> [BindingResource<'_>; 2] {
        [&self.light.view, &self.through.view].map(BindingResource::TextureView)
    }
}
