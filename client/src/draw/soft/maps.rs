//! A shadow map from each of a lamp's points, one at a time in the same target.

use camera::Pinhole;
use gpu::Gpu;
use surface::{CastPass, GBuffer, HeldSurfaces, SurfaceError};
use wgpu::TextureView;

use crate::draw::fullscreen::Target;

/// See the module.
#[derive(Debug)]
pub(super) struct PointMaps {
    gpu: Gpu,
    casting: CastPass,
    map: Option<Map>,
}

#[derive(Debug)]
struct Map {
    w: Target,
    depth: Target,
}

impl PointMaps {
    pub(super) fn new(gpu: &Gpu) -> Result<PointMaps, SurfaceError> {
        Ok(PointMaps { gpu: gpu.clone(), casting: CastPass::new(gpu)?, map: None })
    }

    /// What `view` sees of the casters, as inverse depths; 0 where nothing. The next one takes its place.
    pub(super) fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        casters: &HeldSurfaces,
        view: &Pinhole,
    ) -> &TextureView {
        let size_px = (view.width_px, view.height_px);
        let fits = |map: &Map| (map.w.texture.width(), map.w.texture.height()) == size_px;
        if !self.map.as_ref().is_some_and(fits) {
            let target = |label, format| Target::new(&self.gpu, label, size_px, format);
            self.map = Some(Map { w: target("point map", GBuffer::W), depth: target("point depth", GBuffer::DEPTH) });
        }
        let map = self.map.as_ref().expect("made above");
        self.casting.encode(encoder, casters, view, (&map.w.view, &map.depth.view));
        &map.w.view
    }
}
