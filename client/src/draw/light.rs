//! From the G-buffer to lit surfaces, by the scene's own lights and materials.

use camera::Pinhole;
use glam::DVec3;
use gpu::{Gpu, LightingUniform, MaterialUniform, PinholeUniform, SkyTexture};
use protocol::Held;
use surface::GBuffer;
use wgpu::util::DeviceExt;
use wgpu::{BindingResource, TextureFormat};

use crate::draw::effects::Strengths;
use crate::draw::fullscreen::{Binding, EMBEDDED, FullscreenPass, Onto, Program, uniform};
use crate::draw::lit::{Lit, LitLayer};
use crate::draw::shares::Shares;

/// See the module.
#[derive(Debug)]
pub(crate) struct LightPass {
    gpu: Gpu,
    sky: SkyTexture,
    /// Where all light arrives.
    unhidden: ByLook,
    /// With less light where it is hidden.
    occluded: ByLook,
    /// Of what is seen through.
    layer: ByLook,
    /// A texel that says that all light arrives; made when it is first needed.
    all: Option<wgpu::TextureView>,
}

/// A fragment stage of `client/light.wgsl` for the plain look, and for the full one: a frame in the plain look would take a tenth longer on a software
/// adapter, which goes through both sides of what a uniform decides. Each is made when it is first drawn with.
#[derive(Debug)]
struct ByLook {
    fragment: &'static str,
    bindings: Vec<Binding>,
    formats: Vec<TextureFormat>,
    made: [Option<FullscreenPass>; 2],
}

impl ByLook {
    fn new(fragment: &'static str, bindings: &[Binding], formats: &[TextureFormat]) -> ByLook {
        ByLook { fragment, bindings: bindings.to_vec(), formats: formats.to_vec(), made: [None, None] }
    }

    fn of(&mut self, gpu: &Gpu, lighting: &LightingUniform) -> &FullscreenPass {
        let is_full = lighting.sky > 0.0;
        let (fragment, bindings, formats) = (self.fragment, &self.bindings, &self.formats);
        self.made[usize::from(is_full)].get_or_insert_with(|| {
            let constants = [("may_be_full", f64::from(u8::from(is_full)))];
            let program = Program { constants: &constants, ..Program::fullscreen("client/light.wgsl", fragment) };
            FullscreenPass::of(gpu, program, Onto::Nothing, bindings, formats).expect(EMBEDDED)
        })
    }
}

/// How surfaces are lit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lighten<'a> {
    pub camera: &'a Pinhole,
    /// What was captured by this very camera has the side's normal that the camera sees, however it is bent; elsewhere surfaces of two sides are
    /// turned towards the eye.
    pub at_rest: bool,
    /// What all light is multiplied by before it is shown.
    pub exposure: f32,
    /// Whether rays will bring what rough mirrors show.
    pub rays_of_mirrors: bool,
}

impl LightPass {
    pub(crate) fn new(gpu: &Gpu) -> LightPass {
        let shares = [Binding::FloatTexture; 2];
        let occluded: Vec<Binding> = BINDINGS.into_iter().chain(shares).collect();
        let formats = [Lit::COLOUR, Lit::W, LitLayer::THROUGH];
        LightPass {
            gpu: gpu.clone(),
            sky: SkyTexture::default(),
            unhidden: ByLook::new("light", &BINDINGS, &formats[..2]),
            occluded: ByLook::new("light_occluded", &occluded, &formats[..2]),
            layer: ByLook::new("light_layer", &BINDINGS, &formats),
            all: None,
        }
    }

    /// Light arrives by its shares where these say so.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (gbuffer, shares): (&GBuffer, Shares<'_>),
        held: &Held,
        Lighten { camera, at_rest, exposure, rays_of_mirrors }: Lighten<'_>,
        lit: &Lit,
    ) {
        let eye_world = camera.world_from_eye.translation;
        let Strengths { occlusion, shadows } = shares.strengths;
        let mut lighting = LightingUniform {
            occlusion_strength: occlusion,
            shadow_strength: shadows,
            ..lighting_of(held, eye_world, exposure)
        };
        let is_occluded = !shares.is_all();
        if let (Some(of_lights), true) = (&shares.lights, is_occluded) {
            for (&light, channel) in of_lights.lights.iter().zip(0..) {
                lighting.lights[light].shadow = 1 + channel;
            }
        }
        let table = if rays_of_mirrors { MaterialUniform::table_with_rays } else { MaterialUniform::table };
        let mut table = table(&held.materials);
        if at_rest {
            table.iter_mut().for_each(|material| material.flags &= !MaterialUniform::DOUBLE_SIDED);
        }
        let sources = self.sources((held, camera), &lighting, &table);
        let mut inputs = sources.inputs(gbuffer);
        let mut pass = &mut self.unhidden;
        if is_occluded {
            let all = self.all.get_or_insert_with(|| all_light(&self.gpu));
            let ambient = shares.ambient.map_or(&*all, |target| &target.view);
            let of_lights = shares.lights.map_or(&*all, |shares| &shares.target.view);
            inputs.extend([ambient, of_lights].map(BindingResource::TextureView));
            pass = &mut self.occluded;
        }
        pass.of(&self.gpu, &lighting).encode(encoder, &inputs, &[&lit.colour.view, &lit.w.view]);
    }

    /// The same of a layer of what is seen through, on which no shadow falls.
    pub(crate) fn encode_layer(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        gbuffer: &GBuffer,
        (held, camera): (&Held, &Pinhole),
        exposure: f32,
        lit: &LitLayer,
    ) {
        let lighting = lighting_of(held, camera.world_from_eye.translation, exposure);
        let sources = self.sources((held, camera), &lighting, &MaterialUniform::table(&held.materials));
        let targets = [&lit.lit.colour.view, &lit.lit.w.view, &lit.through.view];
        self.layer.of(&self.gpu, &lighting).encode(encoder, &sources.inputs(gbuffer), &targets);
    }

    fn sources(
        &mut self,
        (held, camera): (&Held, &Pinhole),
        lighting: &LightingUniform,
        table: &[MaterialUniform],
    ) -> Sources {
        let eye_world = camera.world_from_eye.translation;
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&PinholeUniform::new(camera, eye_world)));
        let lighting = uniform(&self.gpu, "lighting", bytemuck::bytes_of(lighting));
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(table));
        let sky = self.sky.of(&self.gpu, held.sky.as_ref());
        Sources { camera, lighting, materials, sky }
    }
}

/// What surfaces are lit by.
struct Sources {
    camera: wgpu::Buffer,
    lighting: wgpu::Buffer,
    materials: wgpu::Buffer,
    sky: wgpu::TextureView,
}

impl Sources {
    /// In the order of [`BINDINGS`].
    fn inputs<'a>(&'a self, gbuffer: &'a GBuffer) -> Vec<BindingResource<'a>> {
        let views = &gbuffer.views;
        let buffers = [&self.camera, &self.lighting, &self.materials].map(wgpu::Buffer::as_entire_binding);
        let textures = [&views.colour, &views.normal_ids, &views.w, &self.sky].map(BindingResource::TextureView);
        buffers.into_iter().chain(textures).collect()
    }
}

/// Of `client/light.wgsl`.
const BINDINGS: [Binding; 7] = [
    Binding::Uniform,
    Binding::Uniform,
    Binding::Uniform,
    Binding::FloatTexture,
    Binding::UintTexture,
    Binding::FloatTexture,
    Binding::FloatTexture,
];

/// The lighting of what is held, as seen from an eye; all of it is multiplied by `exposure` before the tone.
pub(crate) fn lighting_of(held: &Held, eye_world: DVec3, exposure: f32) -> LightingUniform {
    let of = |lighting| LightingUniform::new(lighting, held.sky.as_deref(), eye_world);
    LightingUniform { exposure, ..held.lighting.as_ref().map_or_else(bytemuck::Zeroable::zeroed, of) }
}

/// A texel that says that all light arrives.
fn all_light(gpu: &Gpu) -> wgpu::TextureView {
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("all light"),
            size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &[u8::MAX; 4],
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
