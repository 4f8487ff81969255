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
}

impl LightPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<LightPass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let bindings = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
        let pass = FullscreenPass::new(gpu, "client/light.wgsl", "light", &bindings, &[Lit::COLOUR, FILL_W])?;
        Ok(LightPass { gpu: gpu.clone(), pass })
    }

    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        gbuffer: &GBuffer,
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
        let inputs = [
            camera.as_entire_binding(),
            lighting.as_entire_binding(),
            materials.as_entire_binding(),
            BindingResource::TextureView(&gbuffer.views.colour),
            BindingResource::TextureView(&gbuffer.views.normal_ids),
            BindingResource::TextureView(&gbuffer.views.w),
        ];
        self.pass.encode(encoder, &inputs, &[&lit.colour.view, &lit.w.view]);
    }
}
