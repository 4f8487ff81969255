//! What is shown while points of a lamp are missing: shares in steps of one point, averaged along each surface.
//!
//! All pixels are asked about the same points, so a penumbra is as many bands as points were drawn. An edge-aware filter evens them out: two
//! passes of a 3 x 3 tent, the second with twice the stride (the à-trous transform with edge stopping of Dammertz, Sewtz, Hanika, Lensch,
//! *Edge-avoiding À-Trous wavelet transform for fast global illumination filtering*, 2010). It stops where another surface begins, and by what the
//! shares differ: by one point's worth it counts a third, by more than [`WIDEST_STEPS`] nothing, so outlines that hide several points at once stay
//! sharp, and the more points were drawn, the less is left to even out. When all were, nothing is filtered.

use bytemuck::{Pod, Zeroable};
use gpu::{Gpu, PinholeUniform};
use wgpu::{BindingResource, TextureView};

use super::count::Count;
use super::receivers::Receivers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};

/// In points: what differs by as much does not count. More evens out more of the bands and more of the edges: of 4 points on a meadow 2.5 leave
/// half of the error of none and 1.5 two thirds, of 16 points over streets 2.5 add a sixth, 1.5 a fifteenth.
const WIDEST_STEPS: f32 = 1.5;
/// Of the passes, in pixels; a third with 4 blurs streets more than it smooths meadows.
const STRIDES_PX: [i32; 2] = [1, 2];

/// `Smooth` of `client/soft_smooth.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct SmoothUniform {
    stride_px: i32,
    widest: f32,
    padding: [f32; 2],
}

/// See the module.
#[derive(Debug)]
pub(super) struct SmoothPass {
    gpu: Gpu,
    pass: FullscreenPass,
    /// Of the last view's size.
    targets: Option<((u32, u32), [Target; 2])>,
}

impl SmoothPass {
    pub(super) fn new(gpu: &Gpu) -> Result<SmoothPass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let bindings = [Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
        let path = "client/soft_smooth.wgsl";
        let pass = FullscreenPass::new(gpu, path, "smooth_hidden", &bindings, &[Count::FORMAT])?;
        Ok(SmoothPass { gpu: gpu.clone(), pass, targets: None })
    }

    /// From shares that are counted in parts of `points`.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (hidden, points): (&TextureView, usize),
        receivers: Receivers<'_>,
    ) -> TextureView {
        let size_px = receivers.gbuffer.size_px;
        let target = |label| Target::new(&self.gpu, label, size_px, Count::FORMAT);
        let (_, targets) = match self.targets.take() {
            Some(targets) if targets.0 == size_px => self.targets.insert(targets),
            _ => self.targets.insert((size_px, ["smoother light", "smooth light"].map(target))),
        };
        let camera = PinholeUniform::new(receivers.view, receivers.view.world_from_eye.translation);
        let camera = uniform(&self.gpu, "camera", bytemuck::bytes_of(&camera));
        let views = &receivers.gbuffer.views;
        let mut from = hidden;
        for (stride_px, target) in STRIDES_PX.into_iter().zip(&*targets) {
            let smooth = SmoothUniform { stride_px, widest: WIDEST_STEPS / points as f32, padding: [0.0; 2] };
            let smooth = uniform(&self.gpu, "smooth", bytemuck::bytes_of(&smooth));
            let inputs = [
                camera.as_entire_binding(),
                smooth.as_entire_binding(),
                BindingResource::TextureView(&views.w),
                BindingResource::TextureView(&views.normal_ids),
                BindingResource::TextureView(from),
            ];
            self.pass.encode(encoder, &inputs, &[&target.view]);
            from = &target.view;
        }
        from.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(SmoothUniform, "client/soft_smooth.wgsl", "Smooth", stride_px, widest);
    }
}
