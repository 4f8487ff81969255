//! Textures with mip-maps. Colours are averaged in linear light, weighted by alpha, and with the coverage of cut-outs kept
//! (Castano, Computing Alpha Mipmaps, 2010), so that leaves do not vanish in the distance; normals as they are.

use std::sync::LazyLock;

use gpu::Gpu;
use scene::model::{Texture, Wrap};

/// What a texture holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Content {
    /// sRGB-encoded colours; where the material is cut out, the alpha below which it is.
    Colours(Option<f32>),
    /// Numbers, among them normals.
    Numbers,
}

/// One level: RGBA rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Level {
    pub width_px: u32,
    pub height_px: u32,
    pub rgba: Vec<u8>,
}

/// One level of codes into the table of materials: a byte a texel, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CodeLevel {
    pub width_px: u32,
    pub height_px: u32,
    pub codes: Vec<u8>,
}

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let c = code as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
});

static PLAIN: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| code as f32 / 255.0));

/// sRGB codes of 4096 linear steps; fine enough that encoding a decoded code returns it (the smallest step between two codes
/// is 1/3294).
static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| (0..=4096).map(|step| encode(step as f32 / 4096.0)).collect());

/// What a byte of a texel stands for, 0 to 1: of an sRGB-encoded colour in linear light.
pub(crate) fn decoded(code: u8, is_colour: bool) -> f32 {
    if is_colour { LINEAR[usize::from(code)] } else { PLAIN[usize::from(code)] }
}

fn encode(linear: f32) -> u8 {
    let c = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (c * 255.0).round().clamp(0.0, 255.0) as u8
}

/// The levels of a texture down to one texel.
pub(crate) fn levels(texture: &Texture, content: Content) -> Vec<Level> {
    let cutoff = match content {
        Content::Colours(cutoff) => cutoff,
        Content::Numbers => None,
    };
    let halved = match content {
        Content::Colours(_) => |level: &Level, weighted| half(level, weighted, &LINEAR, encoded),
        Content::Numbers => {
            |level: &Level, weighted| half(level, weighted, &PLAIN, |mean| (mean * 255.0).round() as u8)
        }
    };
    let base = Level { width_px: texture.width_px, height_px: texture.height_px, rgba: texture.rgba.clone() };
    let coverage = cutoff.map(|cutoff| coverage(&base, cutoff));
    let mut levels = vec![base];
    while let Some(last) = levels.last().filter(|last| last.width_px > 1 || last.height_px > 1) {
        let next = halved(last, cutoff.is_some());
        levels.push(next);
    }
    if let (Some(cutoff), Some(coverage)) = (cutoff, coverage) {
        // After all of them are made, so that corrections do not pile up.
        levels.iter_mut().skip(1).for_each(|level| keep_coverage(level, cutoff, coverage));
    }
    levels
}

/// Half the pixels along both sides: means of the numbers that codes stand for, coded again.
fn half(level: &Level, weighted: bool, decoded: &[f32; 256], encoded: impl Fn(f32) -> u8) -> Level {
    let (width_px, height_px) = ((level.width_px / 2).max(1), (level.height_px / 2).max(1));
    let mut rgba = Vec::with_capacity(width_px as usize * height_px as usize * 4);
    let row_bytes = level.width_px as usize * 4;
    for y in 0..height_px {
        let top = (2 * y).min(level.height_px - 1) as usize * row_bytes;
        let bottom = (2 * y + 1).min(level.height_px - 1) as usize * row_bytes;
        for x in 0..width_px {
            let left = (2 * x).min(level.width_px - 1) as usize * 4;
            let right = (2 * x + 1).min(level.width_px - 1) as usize * 4;
            let texels = [top + left, top + right, bottom + left, bottom + right].map(|at| &level.rgba[at..at + 4]);
            let alpha_sum: u32 = texels.iter().map(|texel| u32::from(texel[3])).sum();
            let weigh = |texel: &[u8]| if weighted && alpha_sum > 0 { f32::from(texel[3]) } else { 1.0 };
            let weight_sum: f32 = texels.iter().map(|texel| weigh(texel)).sum();
            for channel in 0..3 {
                let sum: f32 = texels.iter().map(|texel| weigh(texel) * decoded[usize::from(texel[channel])]).sum();
                rgba.push(encoded(sum / weight_sum));
            }
            rgba.push(((alpha_sum + 2) / 4) as u8);
        }
    }
    Level { width_px, height_px, rgba }
}

fn encoded(linear: f32) -> u8 {
    ENCODED[((linear * 4096.0 + 0.5) as usize).min(4096)]
}

/// The share of texels that are not cut out.
fn coverage(level: &Level, cutoff: f32) -> f64 {
    let kept = level.rgba.chunks_exact(4).filter(|texel| f32::from(texel[3]) >= cutoff * 255.0).count();
    kept as f64 / (level.rgba.len() / 4).max(1) as f64
}

/// Scales alpha so that the wanted share of texels passes the cut-off.
fn keep_coverage(level: &mut Level, cutoff: f32, wanted: f64) {
    let mut histogram = [0_usize; 256];
    level.rgba.chunks_exact(4).for_each(|texel| histogram[usize::from(texel[3])] += 1);
    let wanted_texels = (wanted * (level.rgba.len() / 4) as f64).round() as usize;
    if wanted_texels == 0 {
        return;
    }
    // The alpha that lets through nearest to the wanted number, but something: a leaf rather grows than vanishes.
    let mut passing = 0;
    let mut nearest: Option<(usize, usize)> = None;
    for alpha in (1..256).rev().filter(|&alpha| histogram[alpha] > 0) {
        passing += histogram[alpha];
        let error = passing.abs_diff(wanted_texels);
        if nearest.is_none_or(|(least, _)| error < least) {
            nearest = Some((error, alpha));
        }
    }
    let Some((_, threshold)) = nearest else { return };
    let scale = (cutoff * 255.0).ceil() / threshold as f32;
    for texel in level.rgba.chunks_exact_mut(4) {
        texel[3] = (f32::from(texel[3]) * scale).round().min(255.0) as u8;
    }
}

/// Uploads levels (those that exceed the device's limit are left out) and makes the sampler: trilinear, or nearest in
/// magnification where the scene asks for it.
pub(crate) fn upload(
    gpu: &Gpu,
    texture: &Texture,
    content: Content,
    levels: &[Level],
) -> (wgpu::TextureView, wgpu::Sampler) {
    let limit_px = gpu.device.limits().max_texture_dimension_2d;
    let skipped = levels.iter().take_while(|level| level.width_px > limit_px || level.height_px > limit_px).count();
    let levels = &levels[skipped..];
    let format = match content {
        Content::Colours(_) => wgpu::TextureFormat::Rgba8UnormSrgb,
        Content::Numbers => wgpu::TextureFormat::Rgba8Unorm,
    };
    let rows: Vec<_> = levels.iter().map(|level| (level.width_px, level.height_px, level.rgba.as_slice())).collect();
    let view = with_levels(gpu, "texture", format, &rows);
    let mag_filter = if texture.nearest { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear };
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("texture"),
        address_mode_u: address_mode(texture.wrap[0]),
        address_mode_v: address_mode(texture.wrap[1]),
        mag_filter,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    (view, sampler)
}

/// Uploads codes into the table of materials, see [`super::palette`]. As [`upload`] does, without a sampler: codes have no means.
pub(crate) fn upload_codes(gpu: &Gpu, levels: &[CodeLevel]) -> wgpu::TextureView {
    let rows: Vec<_> = levels.iter().map(|level| (level.width_px, level.height_px, level.codes.as_slice())).collect();
    with_levels(gpu, "codes of materials", wgpu::TextureFormat::R8Uint, &rows)
}

/// A texture of levels: width, height and rows of each.
fn with_levels(gpu: &Gpu, label: &str, format: wgpu::TextureFormat, levels: &[(u32, u32, &[u8])]) -> wgpu::TextureView {
    let size = |(width, height): (u32, u32)| wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let (width_px, height_px, _) = levels[0];
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: size((width_px, height_px)),
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (&(width_px, height_px, rows), mip_level) in levels.iter().zip(0..) {
        let target = wgpu::TexelCopyTextureInfo {
            texture: &texture,
            mip_level,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(rows.len() as u32 / height_px),
            rows_per_image: None,
        };
        gpu.queue.write_texture(target, rows, layout, size((width_px, height_px)));
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn address_mode(wrap: Wrap) -> wgpu::AddressMode {
    match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width_px: u32, height_px: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let rgba =
            (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y)).collect();
        Texture { width_px, height_px, rgba, wrap: [Wrap::Repeat; 2], nearest: false }
    }

    #[test]
    fn encoding_returns_every_decoded_code() {
        for code in 0..=255_u8 {
            assert_eq!(encoded(LINEAR[usize::from(code)]), code);
        }
    }

    #[test]
    fn black_and_white_average_in_linear_light() {
        let checks = texture(8, 8, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let levels = levels(&checks, Content::Colours(None));
        assert_eq!(levels.len(), 4);
        // Linear 0.5 is sRGB 188, not 128.
        assert_eq!(levels[3].rgba, [188, 188, 188, 255]);
    }

    #[test]
    fn numbers_average_as_they_are() {
        let checks = texture(2, 2, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 128, 0, 255] });
        assert_eq!(levels(&checks, Content::Numbers)[1].rgba, [128, 192, 128, 255]);
    }

    #[test]
    fn cut_outs_keep_their_coverage_and_their_colour() {
        // Green leaves in one texel of nine, strewn; nothing (and black) elsewhere.
        let strewn = |x: u32, y: u32| (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(2_246_822_519)) >> 13;
        let leaf = texture(64, 64, |x, y| if strewn(x, y) % 9 == 0 { [0, 200, 0, 255] } else { [0; 4] });
        let whole = coverage(&levels(&leaf, Content::Colours(None))[0], 0.5);
        for level in levels(&leaf, Content::Colours(Some(0.5))).iter().skip(1).take(4) {
            let kept = coverage(level, 0.5);
            assert!(kept >= 0.5 * whole && kept <= 2.0 * whole, "{kept} of {whole} at {}", level.width_px);
            let opaque = level.rgba.chunks_exact(4).filter(|texel| texel[3] >= 128);
            assert!(opaque.clone().count() > 0);
            opaque.for_each(|texel| assert!(texel[1] >= 198, "a dark fringe: {texel:?}"));
        }
    }

    #[test]
    fn odd_sizes_end_at_one_texel() {
        let levels = levels(&texture(5, 3, |_, _| [10, 20, 30, 255]), Content::Colours(None));
        let sizes: Vec<(u32, u32)> = levels.iter().map(|level| (level.width_px, level.height_px)).collect();
        assert_eq!(sizes, [(5, 3), (2, 1), (1, 1)]);
        assert!(levels.iter().all(|level| level.rgba.chunks_exact(4).all(|texel| texel == [10, 20, 30, 255])));
    }
}
