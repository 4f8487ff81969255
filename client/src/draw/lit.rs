//! Surfaces as shown.

use gpu::Gpu;
use wgpu::TextureFormat;

use crate::draw::fullscreen::Target;

/// sRGB bytes, in alpha how much the surface hides, above 0 where there is one, and their inverse depth.
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
