//! The pass that compares a view's pixels with the map of one of a lamp's points, and its uniforms.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::DVec3;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use wgpu::{BindingResource, TextureView};

use super::bias::Bias;
use super::count::Count;
use super::receivers::Receivers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Onto, uniform};
use crate::draw::map_space::from_view;

/// `PointMap` of `client/soft_compare.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct MapUniform {
    map_from_view: [[f32; 4]; 4],
    weights: [f32; 4],
    centre_px: [f32; 2],
    size_px: [f32; 2],
    focal_px: f32,
    near_m: f32,
    rounding: f32,
    rise_texels: f32,
}

/// See the module.
#[derive(Debug)]
pub(super) struct ComparePass {
    gpu: Gpu,
    bias: Bias,
    pass: FullscreenPass,
}

/// Pixels made ready to be compared.
pub(super) struct Ready<'a> {
    receivers: Receivers<'a>,
    camera: wgpu::Buffer,
    materials: wgpu::Buffer,
}

impl ComparePass {
    pub(super) fn new(gpu: &Gpu, bias: Bias) -> Result<ComparePass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let bindings = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
        let shader = ("client/soft_compare.wgsl", "hidden");
        let pass = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[Count::FORMAT])?;
        Ok(ComparePass { gpu: gpu.clone(), bias, pass })
    }

    pub(super) fn prepare<'a>(&self, receivers: Receivers<'a>) -> Ready<'a> {
        let eye_world = receivers.view.world_from_eye.translation;
        let camera = PinholeUniform::new(receivers.view, eye_world);
        let materials = MaterialUniform::table(&receivers.held.materials);
        Ready {
            receivers,
            camera: uniform(&self.gpu, "camera", bytemuck::bytes_of(&camera)),
            materials: uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials)),
        }
    }

    /// Adds `weights` where the map has something before a pixel's point.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        ready: &Ready<'_>,
        (map, w): (&Pinhole, &TextureView),
        weights: [f32; 4],
        hidden: &TextureView,
    ) {
        let eye_world = ready.receivers.view.world_from_eye.translation;
        let map =
            uniform(&self.gpu, "point map", bytemuck::bytes_of(&MapUniform::new(map, eye_world, weights, self.bias)));
        let views = &ready.receivers.gbuffer.views;
        let inputs = [
            ready.camera.as_entire_binding(),
            ready.materials.as_entire_binding(),
            map.as_entire_binding(),
            BindingResource::TextureView(&views.w),
            BindingResource::TextureView(&views.normal_ids),
            BindingResource::TextureView(w),
        ];
        self.pass.encode(encoder, &inputs, &[hidden]);
    }
}

impl MapUniform {
    fn new(map: &Pinhole, eye_world: DVec3, weights: [f32; 4], bias: Bias) -> MapUniform {
        MapUniform {
            map_from_view: from_view(map, eye_world),
            weights,
            centre_px: map.centre_px.as_vec2().to_array(),
            size_px: [map.width_px as f32, map.height_px as f32],
            focal_px: map.focal_px as f32,
            near_m: map.near_m as f32,
            rounding: bias.rounding(),
            rise_texels: bias.rise_texels(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "client/soft_compare.wgsl";
        shaders::assert_layout!(
            MapUniform,
            path,
            "PointMap",
            map_from_view,
            weights,
            centre_px,
            size_px,
            focal_px,
            near_m,
            rounding,
            rise_texels
        );
    }
}
