//! A pyramid of the lit picture from which small holes are filled: the pull half of push-pull (Gortler et al., The Lumigraph,
//! 1996, §3.4), with the farther surface preferred (ours), since a hole shows what the nearer one hid, and only if that goes on: beside
//! surfaces that say that they end (`protocol/src/ends.rs`) is a gap that the scene has. The push half is one look-up a hole, in `client/present.wgsl`.

use gpu::Gpu;
use surface::GBuffer;
use wgpu::{BindingResource, TextureFormat};

use crate::draw::fullscreen::{Binding, FullscreenPass, Target};
use crate::draw::lit::Lit;

/// Holes up to about 16 pixels wide are filled: 2 to the number of levels is 16 where a pixel has one sample (the last level is left out then), and
/// 32 samples where it has 2 x 2.
pub(crate) const LEVELS: usize = 5;

/// Of what a level says: inverse depth, and how much more of the border goes on than ends, by `client/pull_first.wgsl`.
const W_OPEN: TextureFormat = TextureFormat::Rg32Float;

/// Level 1 (half the size) and up.
#[derive(Debug)]
pub(crate) struct Pyramid {
    levels: [Level; LEVELS],
}

/// See `client/pull_level.wgsl`.
#[derive(Debug)]
struct Level {
    colour: Target,
    w_open: Target,
}

impl Pyramid {
    pub(crate) fn new(gpu: &Gpu, (width, height): (u32, u32)) -> Pyramid {
        let level = |level: usize| {
            let size_px = (width.div_ceil(2 << level), height.div_ceil(2 << level));
            Level {
                colour: Target::new(gpu, "fill colour", size_px, Lit::COLOUR),
                w_open: Target::new(gpu, "fill w and open", size_px, W_OPEN),
            }
        };
        Pyramid { levels: std::array::from_fn(level) }
    }

    /// The same textures as [`Pyramid::views`].
    pub(crate) fn textures(&self) -> impl Iterator<Item = &wgpu::Texture> {
        self.levels.iter().flat_map(|level| [&level.colour.texture, &level.w_open.texture])
    }

    /// Both textures of each level, level 1 first.
    pub(crate) fn views(&self) -> impl Iterator<Item = BindingResource<'_>> {
        self.levels
            .iter()
            .flat_map(|level| [&level.colour, &level.w_open])
            .map(|of| BindingResource::TextureView(&of.view))
    }
}

/// See the module.
#[derive(Debug)]
pub(crate) struct FillPass {
    first: FullscreenPass,
    next: FullscreenPass,
}

impl FillPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<FillPass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture};
        let formats = [Lit::COLOUR, W_OPEN];
        let bindings = [FloatTexture, FloatTexture, UintTexture];
        let first = FullscreenPass::new(gpu, "client/pull_first.wgsl", "pull_first", &bindings, &formats)?;
        let next = FullscreenPass::new(gpu, "client/pull.wgsl", "pull", &[FloatTexture; 2], &formats)?;
        Ok(FillPass { first, next })
    }

    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, lit: &Lit, gbuffer: &GBuffer, pyramid: &Pyramid) {
        let targets = |level: usize| [&pyramid.levels[level].colour.view, &pyramid.levels[level].w_open.view];
        let inputs = [&lit.colour.view, &lit.w.view, &gbuffer.views.normal_ids].map(BindingResource::TextureView);
        self.first.encode(encoder, &inputs, &targets(0));
        for level in 1..LEVELS {
            self.next.encode(encoder, &targets(level - 1).map(BindingResource::TextureView), &targets(level));
        }
    }
}
