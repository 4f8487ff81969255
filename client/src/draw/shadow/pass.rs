//! The pass that compares a view's pixels with shadow maps, and its uniforms.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::DVec3;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use protocol::Held;
use surface::GBuffer;
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::fullscreen::{Binding, FullscreenPass, Onto, Target, begin, uniform};
use crate::draw::map_space::{ROUNDING, from_view};

/// The most maps of a light: the faces of a cube. The twin of the constant in `client/shadow.wgsl`.
pub(super) const MAPS: usize = 6;
/// The most lights that cast: the channels of a target.
pub(super) const CHANNELS: usize = 4;

/// `ShadowMap` of `client/shadow.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct MapUniform {
    map_from_view: [[f32; 4]; 4],
    focal_px: f32,
    padding: [f32; 3],
}

/// `Shadow` of `client/shadow.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct ShadowUniform {
    channel: [f32; CHANNELS],
    map_count: u32,
    own: u32,
    side_px: f32,
    rounding: f32,
    sample_texels: f32,
    padding: [f32; 3],
    maps: [MapUniform; MAPS],
}

/// A map of a light.
pub(super) struct Map<'a> {
    pub view: &'a Pinhole,
    /// Its inverse depths.
    pub w: &'a TextureView,
    /// Samples of what casts are as wide as so many texels, at least one.
    pub sample_texels: f32,
}

/// A light's maps.
pub(super) type Maps<'a> = Vec<Map<'a>>;

/// See the module.
#[derive(Debug)]
pub(super) struct SharePass {
    gpu: Gpu,
    pass: FullscreenPass,
}

impl SharePass {
    /// Of what is drawn.
    pub(super) const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

    pub(super) fn new(gpu: &Gpu) -> Result<SharePass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let bindings = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
        let shader = ("client/shadow.wgsl", "light_share");
        let pass = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[SharePass::FORMAT])?;
        Ok(SharePass { gpu: gpu.clone(), pass })
    }

    /// Writes how much of each light arrives where into its channel, in the order of `lights`; 0 into the others.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (gbuffer, held, view): (&GBuffer, &Held, &Pinhole),
        lights: &[Maps<'_>],
        target: &Target,
    ) {
        let eye_world = view.world_from_eye.translation;
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&PinholeUniform::new(view, eye_world)));
        let materials = MaterialUniform::table(&held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let mut pass = begin(encoder, "light shares", true, &[&target.view], None);
        for (channel, maps) in lights.iter().enumerate() {
            for (own, map) in maps.iter().enumerate() {
                let shadow = ShadowUniform::new((channel, own), maps, eye_world);
                let shadow = uniform(&self.gpu, "shadow", bytemuck::bytes_of(&shadow));
                let inputs = [
                    camera.as_entire_binding(),
                    materials.as_entire_binding(),
                    shadow.as_entire_binding(),
                    BindingResource::TextureView(&gbuffer.views.w),
                    BindingResource::TextureView(&gbuffer.views.normal_ids),
                    BindingResource::TextureView(map.w),
                ];
                self.pass.draw(&mut pass, &inputs);
            }
        }
    }
}

impl ShadowUniform {
    fn new((channel, own): (usize, usize), maps: &Maps<'_>, eye_world: DVec3) -> ShadowUniform {
        let mut uniform: ShadowUniform = Zeroable::zeroed();
        uniform.channel[channel] = 1.0;
        uniform.map_count = maps.len() as u32;
        uniform.sample_texels = maps[own].sample_texels;
        uniform.own = own as u32;
        uniform.rounding = ROUNDING as f32;
        for (slot, Map { view, .. }) in uniform.maps.iter_mut().zip(maps) {
            uniform.side_px = view.width_px as f32;
            *slot = MapUniform::new(view, eye_world);
        }
        uniform
    }
}

impl MapUniform {
    fn new(map: &Pinhole, eye_world: DVec3) -> MapUniform {
        MapUniform { map_from_view: from_view(map, eye_world), focal_px: map.focal_px as f32, padding: [0.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "client/shadow.wgsl";
        shaders::assert_layout!(MapUniform, path, "ShadowMap", map_from_view, focal_px);
        shaders::assert_layout!(
            ShadowUniform,
            path,
            "Shadow",
            channel,
            map_count,
            own,
            side_px,
            rounding,
            sample_texels,
            maps
        );
    }
}
