//! A pyramid of the lit picture from which small holes are filled: the pull half of push-pull (Gortler et al., The Lumigraph,
//! 1996, §3.4), with the farther surface preferred (ours), since a hole shows what the nearer one hid. The push half is one
//! look-up a hole, in `client/present.wgsl`.

use gpu::Gpu;
use wgpu::BindingResource;

use crate::draw::fullscreen::{Binding, FullscreenPass};
use crate::draw::lit::Lit;

/// Holes up to about 16 pixels wide are filled: 2 to the number of levels is 16 where a pixel has one sample (the last level is left out then), and
/// 32 samples where it has 2 x 2.
pub(crate) const LEVELS: usize = 5;

/// Level 1 (half the size) and up.
#[derive(Debug)]
pub(crate) struct Pyramid {
    levels: [Lit; LEVELS],
}

impl Pyramid {
    pub(crate) fn new(gpu: &Gpu, (width, height): (u32, u32)) -> Pyramid {
        let size = |level: usize| (width.div_ceil(2 << level), height.div_ceil(2 << level));
        Pyramid { levels: std::array::from_fn(|level| Lit::new(gpu, size(level))) }
    }

    /// The colours with the covered share in alpha, level 1 first.
    pub(crate) fn views(&self) -> [BindingResource<'_>; LEVELS] {
        self.levels.each_ref().map(|level| BindingResource::TextureView(&level.colour.view))
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct FillPass {
    pass: FullscreenPass,
}

impl FillPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<FillPass, shaders::ShaderError> {
        let bindings = [Binding::FloatTexture; 2];
        let pass = FullscreenPass::new(gpu, "client/pull.wgsl", "pull", &bindings, &[Lit::COLOUR, Lit::W])?;
        Ok(FillPass { pass })
    }

    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, lit: &Lit, pyramid: &Pyramid) {
        let mut from = lit;
        for level in &pyramid.levels {
            let inputs = [BindingResource::TextureView(&from.colour.view), BindingResource::TextureView(&from.w.view)];
            self.pass.encode(encoder, &inputs, &[&level.colour.view, &level.w.view]);
            from = level;
        }
    }
}
