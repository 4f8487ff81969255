//! A sky as passes read it.

use std::sync::Arc;

use protocol::Sky;
use wgpu::util::DeviceExt;

use crate::Gpu;

/// The levels of a sky, one under the other in one texture, the first one at the top, as `common/sky.wgsl` reads them. Made anew when another
/// sky is shown; without one, or before the first, a black texel.
#[derive(Debug, Default)]
pub struct SkyTexture {
    made: Option<(Option<Arc<Sky>>, wgpu::TextureView)>,
}

impl SkyTexture {
    /// Linear RGB; alpha counts for nothing.
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

    /// The texture of a sky.
    pub fn of(&mut self, gpu: &Gpu, sky: Option<&Arc<Sky>>) -> wgpu::TextureView {
        let is_same = |known: &Option<Arc<Sky>>| match (known, sky) {
            (Some(known), Some(sky)) => Arc::ptr_eq(known, sky),
            (known, sky) => known.is_none() && sky.is_none(),
        };
        let made = self.made.take().filter(|(known, _)| is_same(known));
        let (_, view) = self.made.insert(made.unwrap_or_else(|| (sky.cloned(), upload(gpu, sky.map(|sky| &**sky)))));
        view.clone()
    }
}

fn upload(gpu: &Gpu, sky: Option<&Sky>) -> wgpu::TextureView {
    let (width, texels) = match sky {
        Some(sky) => texels(sky),
        None => (1, vec![[0; 4]]),
    };
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("sky"),
            size: wgpu::Extent3d { width, height: texels.len() as u32 / width, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SkyTexture::FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// The width of the texture, and its texels.
fn texels(sky: &Sky) -> (u32, Vec<[u16; 4]>) {
    let first = usize::from(sky.first_level);
    let width = Sky::side_px(first);
    let mut texels = Vec::new();
    for (level, number) in sky.levels.iter().zip(first..) {
        for row in level.texels.chunks_exact(Sky::side_px(number)) {
            texels.extend(row.iter().map(|&[r, g, b]| [r, g, b, 0]));
            texels.resize(texels.len() + width - row.len(), [0; 4]);
        }
    }
    (width as u32, texels)
}
