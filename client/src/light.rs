//! From the G-buffer to lit surfaces, by the scene's own lights and materials.

use camera::Pinhole;
use gpu::{Gpu, LightingUniform, MaterialUniform, PinholeUniform};
use protocol::Held;
use surface::GBuffer;
use wgpu::{BindingResource, TextureFormat};

use crate::fill::FILL_W;
use crate::fullscreen::{Binding, FullscreenPass, Target, uniform};

/// Surfaces as shown: sRGB bytes, alpha 1 where there is a surface, and their inverse depth.
#[derive(Debug)]
pub(crate) struct Lit {
    pub(crate) colour: Target,
    pub(crate) w: Target,
}

impl Lit {
    /// Of `colour`.
    pub(crate) const COLOUR: TextureFormat = TextureFormat::Rgba8Unorm;

    pub(crate) fn new(gpu: &Gpu, size_px: (u32, u32)) -> Lit {
        Lit {
            colour: Target::new(gpu, "lit colour", size_px, Lit::COLOUR),
            w: Target::new(gpu, "lit w", size_px, FILL_W),
        }
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct LightPass {
    gpu: Gpu,
    pass: FullscreenPass,
    /// With less ambient light where it is hidden; made when it is first needed.
    occluded: Option<FullscreenPass>,
}

impl LightPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<LightPass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let bindings = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
        let pass = FullscreenPass::new(gpu, "client/light.wgsl", "light", &bindings, &[Lit::COLOUR, FILL_W])?;
        Ok(LightPass { gpu: gpu.clone(), pass, occluded: None })
    }

    /// Makes ready for shares of ambient light.
    pub(crate) fn prepare_occluded(&mut self) -> Result<(), shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        if self.occluded.is_none() {
            let bindings = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture, FloatTexture];
            let formats = [Lit::COLOUR, FILL_W];
            let pass = FullscreenPass::new(&self.gpu, "client/light.wgsl", "light_occluded", &bindings, &formats)?;
            self.occluded = Some(pass);
        }
        Ok(())
    }

    /// `ambient_shares` say how much of the ambient light arrives at each pixel; without them, or before
    /// [`LightPass::prepare_occluded`], all of it does.
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (gbuffer, ambient_shares): (&GBuffer, Option<&Target>),
        held: &Held,
        camera: &Pinhole,
        lit: &Lit,
    ) {
        let eye_world = camera.world_from_eye.translation;
        let lighting = match &held.lighting {
            Some(lighting) => LightingUniform::new(lighting, eye_world),
            None => bytemuck::Zeroable::zeroed(),
        };
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&PinholeUniform::new(camera, eye_world)));
        let lighting = uniform(&self.gpu, "lighting", bytemuck::bytes_of(&lighting));
        let table = MaterialUniform::table(&held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&table));
        let mut inputs = vec![
            camera.as_entire_binding(),
            lighting.as_entire_binding(),
            materials.as_entire_binding(),
            BindingResource::TextureView(&gbuffer.views.colour),
            BindingResource::TextureView(&gbuffer.views.normal_ids),
            BindingResource::TextureView(&gbuffer.views.w),
        ];
        let mut pass = &self.pass;
        if let (Some(occluded), Some(shares)) = (&self.occluded, ambient_shares) {
            inputs.push(BindingResource::TextureView(&shares.view));
            pass = occluded;
        }
        pass.encode(encoder, &inputs, &[&lit.colour.view, &lit.w.view]);
    }
}
