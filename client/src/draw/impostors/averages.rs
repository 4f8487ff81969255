//! Colours of an impostor, and their averages over blocks of 2x2 samples, 4x4 and so on.

/// The texels of a texture of four bytes, as `client/impostors/filter.wgsl` reads them: laid out as [`impostor::RangeTexels`]. Of the
/// samples, base colour as sRGB bytes and the material's code; of blocks, the average of their samples and, for 255, that there
/// are any.
pub(crate) struct ColourTexels {
    pub width: u32,
    pub height: u32,
    pub colours: Vec<[u8; 4]>,
}

/// Linear RGB times a share, and the share.
type Sum = [f32; 4];

/// Of colours row by row; `is_held` tells which of them are of samples.
pub(crate) fn colour_texels(
    (width, height): (u32, u32),
    colours: &[[u8; 4]],
    is_held: impl Iterator<Item = bool>,
) -> ColourTexels {
    let side = width.max(height).next_power_of_two() as usize;
    let row_texels = side + side.div_ceil(2);
    let mut texels = vec![[0; 4]; row_texels * side];
    let mut sums: Vec<Sum> = vec![[0.0; 4]; side * side];
    let linear: Vec<f32> = (0..=255_u8).map(linear_from_srgb).collect();
    for ((place, colour), is_held) in colours.iter().enumerate().zip(is_held) {
        let (x, y) = (place % width as usize, place / width as usize);
        if is_held {
            let [r, g, b] = [0, 1, 2].map(|channel| linear[usize::from(colour[channel])]);
            texels[y * row_texels + x] = *colour;
            sums[y * side + x] = [r, g, b, 1.0];
        }
    }
    let mut blocks = side;
    while blocks > 1 {
        sums = halved(&sums, blocks);
        // The rows of all finer blocks stand above.
        let top = side - blocks;
        blocks /= 2;
        for (place, sum) in sums.iter().enumerate() {
            texels[(top + place / blocks) * row_texels + side + place % blocks] = average(*sum);
        }
    }
    ColourTexels { width: row_texels as u32, height: side as u32, colours: texels }
}

fn halved(sums: &[Sum], side: usize) -> Vec<Sum> {
    let add = |a: Sum, b: Sum| std::array::from_fn(|channel| a[channel] + b[channel]);
    let half = side / 2;
    let block = |place: usize| {
        let corner = 2 * (place / half) * side + 2 * (place % half);
        [corner + 1, corner + side, corner + side + 1].into_iter().fold(sums[corner], |sum, at| add(sum, sums[at]))
    };
    (0..half * half).map(block).collect()
}

fn average([r, g, b, share]: Sum) -> [u8; 4] {
    if share <= 0.0 {
        return [0; 4];
    }
    let [r, g, b] = [r, g, b].map(|sum| srgb_from_linear(sum / share));
    [r, g, b, 255]
}

/// The sRGB transfer function, IEC 61966-2-1.
fn linear_from_srgb(encoded: u8) -> f32 {
    let c = f32::from(encoded) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(c: f32) -> u8 {
    let encoded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_the_average_light_of_their_samples() {
        let (white, black) = ([255, 255, 255, 7], [0, 0, 0, 9]);
        let colours = [white, black, black, white, white, white];
        let texels = colour_texels((3, 2), &colours, [true, true, true, true, true, false].into_iter());
        let at = |x: usize, y: usize| texels.colours[y * 6 + x];
        assert_eq!((texels.width, texels.height), (6, 4));
        assert_eq!([at(0, 0), at(1, 0), at(2, 1), at(3, 0)], [white, black, [0; 4], [0; 4]]);
        // Three quarters of the light are shown as 225; the second block holds one sample, which is black.
        assert_eq!([at(4, 0), at(5, 0), at(4, 1)], [[225, 225, 225, 255], [0, 0, 0, 255], [0; 4]]);
        assert_eq!(at(4, 2), [203, 203, 203, 255]);
    }
}
