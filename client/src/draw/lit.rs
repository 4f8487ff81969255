//! Surfaces as shown.

use gpu::Gpu;
use wgpu::TextureFormat;

use crate::draw::fullscreen::Target;

/// sRGB bytes, alpha 1 where there is a surface, and their inverse depth.
#[derive(Debug)]
pub(crate) struct Lit {
    pub(crate) colour: Target,
    pub(crate) w: Target,
}

impl Lit {
    /// Of `colour`.
    pub(crate) const COLOUR: TextureFormat = TextureFormat::Rgba8Unorm;
    /// Of `w`.
    pub(crate) const W: TextureFormat = TextureFormat::R32Float;

    pub(crate) fn new(gpu: &Gpu, size_px: (u32, u32)) -> Lit {
        Lit {
            colour: Target::new(gpu, "lit colour", size_px, Lit::COLOUR),
            w: Target::new(gpu, "lit w", size_px, Lit::W),
        }
    }
}

/// A surface that is seen through: its own light as shown, times what it hides, and the share of what lies behind it that is seen.
#[derive(Debug)]
pub(crate) struct LitLayer {
    pub(crate) lit: Lit,
    /// Linear RGB.
    pub(crate) through: Target,
}

impl LitLayer {
    /// Of `through`.
    pub(crate) const THROUGH: TextureFormat = TextureFormat::Rgba8Unorm;

    pub(crate) fn new(gpu: &Gpu, size_px: (u32, u32)) -> LitLayer {
        LitLayer { lit: Lit::new(gpu, size_px), through: Target::new(gpu, "seen through", size_px, LitLayer::THROUGH) }
    }
}
