//! How much of the picture has no surface: counted on the GPU by tiles, summed on the CPU when the counts arrive.

use gpu::readback::Encoded;
use gpu::{Gpu, Pending, Readback, Slot};
use wgpu::{BindingResource, TextureFormat};

use crate::draw::fullscreen::{Binding, FullscreenPass, Target};
use crate::draw::lit::Lit;

/// Side of a tile; the twin of `TILE_PX` in `client/coverage.wgsl`.
const TILE_PX: u32 = 16;

/// See the module.
#[derive(Debug)]
pub(crate) struct Coverage {
    pass: FullscreenPass,
    encoded: Option<(Encoded, Slot, u64)>,
    pending: Option<(Pending, Slot, u64)>,
    share: Option<f64>,
}

/// One count a tile.
pub(crate) fn tiles(gpu: &Gpu, (width, height): (u32, u32)) -> Target {
    let size_px = (width.div_ceil(TILE_PX), height.div_ceil(TILE_PX));
    Target::new(gpu, "uncovered pixels", size_px, TextureFormat::R32Uint)
}

impl Coverage {
    pub(crate) fn new(gpu: &Gpu) -> Result<Coverage, shaders::ShaderError> {
        let formats = [TextureFormat::R32Uint];
        let bindings = [Binding::FloatTexture];
        let pass = FullscreenPass::new(gpu, "client/coverage.wgsl", "count_uncovered", &bindings, &formats)?;
        Ok(Coverage { pass, encoded: None, pending: None, share: None })
    }

    /// Counts, unless an earlier count is still on its way.
    pub(crate) fn encode(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, lit: &Lit, tiles: &Target) {
        self.collect();
        if self.pending.is_some() {
            return;
        }
        self.pass.encode(encoder, &[BindingResource::TextureView(&lit.colour.view)], &[&tiles.view]);
        let mut readback = Readback::default();
        let slot = readback.texture(&tiles.texture, 0, (tiles.texture.width(), tiles.texture.height()));
        let size = lit.colour.texture.size();
        let pixels = u64::from(size.width) * u64::from(size.height);
        self.encoded = Some((readback.encode(gpu, encoder), slot, pixels));
    }

    /// Asks for the counts, whose commands were just submitted.
    pub(crate) fn submitted(&mut self) {
        if let Some((encoded, slot, pixels)) = self.encoded.take() {
            self.pending = Some((encoded.map(), slot, pixels));
        }
    }

    /// The newest share that has arrived.
    pub(crate) fn share(&mut self) -> Option<f64> {
        self.collect();
        self.share
    }

    fn collect(&mut self) {
        if !self.pending.as_ref().is_some_and(|(pending, ..)| pending.is_ready()) {
            return;
        }
        if let Some((pending, slot, pixels)) = self.pending.take()
            && let Ok(mapped) = pending.take()
        {
            let uncovered: u64 = mapped.values::<u32>(slot).into_iter().map(u64::from).sum();
            self.share = Some(uncovered as f64 / pixels as f64);
        }
    }
}
