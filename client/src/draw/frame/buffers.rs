//! What a frame is drawn into, for who looks at the numbers.

use super::FrameRenderer;
use crate::draw::occlusion::OcclusionRenderer;
use crate::draw::reflect::ReflectPass;
use crate::draw::shadow::ShadowRenderer;

impl FrameRenderer {
    /// The textures of the last frame by what they hold, all of which can be copied: surfaces, shadow maps and shares of light, ambient occlusion,
    /// reflections, the lit picture and what fills its holes. Those of effects that it did not draw may be of an earlier frame.
    pub fn buffers(&self) -> Vec<(&'static str, &wgpu::Texture)> {
        let mut buffers = Vec::new();
        if let Some(targets) = &self.targets {
            let (gbuffer, lit) = (&targets.gbuffer, &targets.lit);
            buffers.extend([
                ("surface colour", &gbuffer.colour),
                ("surface normal and ids", &gbuffer.normal_ids),
                ("surface w", &gbuffer.w),
                ("surface depth", &gbuffer.depth),
                ("lit colour", &lit.colour.texture),
                ("lit w", &lit.w.texture),
            ]);
            buffers.extend(targets.pyramid.textures().map(|texture| ("fill", texture)));
        }
        buffers.extend(self.shadows.iter().flat_map(ShadowRenderer::buffers));
        buffers.extend(self.occlusion.iter().flat_map(OcclusionRenderer::buffers));
        buffers.extend(self.reflect.iter().flat_map(ReflectPass::buffers));
        buffers
    }
}
