//! The image of a body's colours, by texture coordinates.

use camera::{Camera, Pinhole, Rigid};
use protocol::{DepthImage, DepthScale, Mask};
use scene::model::Texture;
use scene::{Material, Scene};

/// The longest side that is sent: more texels than a view has pixels show nowhere but close by.
const MOST_PX: u32 = 1024;
/// Texels beside those that triangles show which blending reads, in texels of the image that is sent: of its coarser levels, too.
const MARGIN_PX: i64 = 4;

/// The image, and the part of the whole texture that it is, in its texture coordinates: the least, and how far it goes. `triangles_uv`: texture coordinates
/// of the triangles that show it, three each.
pub(super) fn atlas(
    scene: &Scene,
    material: &Material,
    code: u8,
    triangles_uv: &[[[f32; 2]; 3]],
) -> (DepthImage, [[f32; 2]; 2]) {
    let factor = material.base_colour;
    let Some(texture) = material.texture.and_then(|texture| scene.textures.get(texture as usize)) else {
        let colour = [0, 1, 2].map(|channel| srgb_from_linear(factor[channel]));
        return (image((1, 1), code, |_, _| Some(colour)), WHOLE);
    };
    let level = level(texture);
    let used = used(&level, triangles_uv);
    let cutoff = material.alpha_cutoff;
    let (from, size_px) = cropped(&level, used.as_deref());
    let image = image(size_px, code, |x, y| {
        let index = ((from.1 + y) * level.width_px + from.0 + x) as usize;
        let [red, green, blue, alpha] = level.rgba[index];
        let is_cut = cutoff.is_some_and(|cutoff| alpha * factor[3] < cutoff);
        let colour = [red * factor[0], green * factor[1], blue * factor[2]].map(srgb_from_linear);
        (!is_cut && used.as_ref().is_none_or(|used| used[index])).then_some(colour)
    });
    let share = |(x, y): (u32, u32)| [x as f32 / level.width_px as f32, y as f32 / level.height_px as f32];
    (image, [share(from), share(size_px)])
}

/// A texture as it is.
const WHOLE: [[f32; 2]; 2] = [[0.0; 2], [1.0; 2]];

/// Levels halve sides and round them down: where a part's sides are multiples of this many texels, all that matter lie as those of the whole texture do.
const ALIGNED_PX: u32 = 64;

/// The box of the texels that are used, grown to that: its upper left one, and its size.
fn cropped(level: &Level, used: Option<&[bool]>) -> ((u32, u32), (u32, u32)) {
    let all = ((0, 0), (level.width_px, level.height_px));
    let Some(used) = used else { return all };
    let places = used.iter().enumerate().filter(|(_, used)| **used).map(|(index, _)| index as u32);
    let places = places.map(|index| (index % level.width_px, index / level.width_px));
    let boxes = places.map(|(x, y)| [x, y, x, y]);
    let around = boxes.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]);
    let span = |first: u32, last: u32, side_px: u32| {
        let from = first / ALIGNED_PX * ALIGNED_PX;
        (from, (last + 1).next_multiple_of(ALIGNED_PX).min(side_px) - from)
    };
    around.map_or(all, |[left, top, right, bottom]| {
        let ((x, width_px), (y, height_px)) = (span(left, right, level.width_px), span(top, bottom, level.height_px));
        ((x, y), (width_px, height_px))
    })
}

/// Rows of texels from the top: linear RGB and alpha.
struct Level {
    width_px: u32,
    height_px: u32,
    rgba: Vec<[f32; 4]>,
}

/// A texture's first level that is no larger than what is sent.
fn level(texture: &Texture) -> Level {
    let texel = |texel: &[u8; 4]| {
        let [red, green, blue, alpha] = texel.map(|value| f32::from(value) / 255.0);
        [linear_from_srgb(red), linear_from_srgb(green), linear_from_srgb(blue), alpha]
    };
    let rgba = texture.rgba.as_chunks::<4>().0.iter().map(texel).collect();
    let mut level = Level { width_px: texture.width_px, height_px: texture.height_px, rgba };
    while level.width_px.max(level.height_px) > MOST_PX {
        level = halved(&level);
    }
    level
}

/// Each texel the mean of four in linear light, as GPUs' levels are.
fn halved(fine: &Level) -> Level {
    let (width_px, height_px) = ((fine.width_px / 2).max(1), (fine.height_px / 2).max(1));
    let texel = |index: u32| {
        let (x, y) = (2 * (index % width_px), 2 * (index / width_px));
        let at =
            |x: u32, y: u32| fine.rgba[(y.min(fine.height_px - 1) * fine.width_px + x.min(fine.width_px - 1)) as usize];
        let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
        std::array::from_fn(|channel| four.iter().map(|texel| texel[channel]).sum::<f32>() / 4.0)
    };
    Level { width_px, height_px, rgba: (0..width_px * height_px).map(texel).collect() }
}

/// Texels are asked for so many times each on the whole: where triangles lie over each other more often, all of an image is taken for used.
const MOST_TIMES: i64 = 16;

/// Which texels any triangle shows; `None` where they are shown past their edges, or over and over.
fn used(level: &Level, triangles_uv: &[[[f32; 2]; 3]]) -> Option<Vec<bool>> {
    let inside = |uv: &[f32; 2]| uv.iter().all(|place| (0.0..=1.0).contains(place));
    if !triangles_uv.as_flattened().iter().all(inside) {
        return None;
    }
    let (width, height) = (i64::from(level.width_px), i64::from(level.height_px));
    let mut used = vec![false; level.rgba.len()];
    let mut left = MOST_TIMES.saturating_mul(width * height);
    for triangle in triangles_uv {
        let corners = triangle.map(|[u, v]| [f64::from(u) * width as f64, f64::from(v) * height as f64]);
        let span = |axis: usize, side: i64| {
            let places = corners.map(|corner| corner[axis]);
            let (low, high) =
                (places.into_iter().fold(f64::INFINITY, f64::min), places.into_iter().fold(0.0, f64::max));
            (low.floor() as i64 - MARGIN_PX).max(0)..(high.ceil() as i64 + MARGIN_PX).min(side)
        };
        let (columns, rows) = (span(0, width), span(1, height));
        left -= (columns.end - columns.start).max(0) * (rows.end - rows.start).max(0);
        if left < 0 {
            return None;
        }
        for y in rows {
            for x in columns.clone() {
                let index = (y * width + x) as usize;
                used[index] = used[index] || is_near(&corners, [x as f64 + 0.5, y as f64 + 0.5]);
            }
        }
    }
    Some(used)
}

/// Whether a texel's middle lies in a triangle or within the margin of its edges' lines.
fn is_near(corners: &[[f64; 2]; 3], p: [f64; 2]) -> bool {
    let side = |a: [f64; 2], b: [f64; 2]| {
        let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let length = along[0].hypot(along[1]);
        if length > 0.0 { (along[0] * to[1] - along[1] * to[0]) / length } else { 0.0 }
    };
    let [a, b, c] = *corners;
    let sides = [side(a, b), side(b, c), side(c, a)];
    let margin = MARGIN_PX as f64;
    sides.iter().all(|&side| side >= -margin) || sides.iter().all(|&side| side <= margin)
}

fn image((width_px, height_px): (u32, u32), code: u8, colour: impl Fn(u32, u32) -> Option<[u8; 3]>) -> DepthImage {
    let mut mask = Mask::empty(width_px, height_px);
    let mut colours = Vec::new();
    for (y, x) in (0..height_px).flat_map(|y| (0..width_px).map(move |x| (y, x))) {
        if let Some(colour) = colour(x, y) {
            mask.set(x, y, true);
            colours.push(colour);
        }
    }
    let count = colours.len();
    DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (width_px, height_px), 1.0, 1.0)),
        depth_scale: DepthScale { w_min: 1.0, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![[127; 2]; count],
        normal_rest: Vec::new(),
        ends: Vec::new(),
        colour: colours,
        colour_rest: Vec::new(),
        object: vec![0; count],
        material: vec![code; count],
        share: Vec::new(),
    }
}

fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(value: f32) -> u8 {
    let value = value.clamp(0.0, 1.0);
    let encoded = if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_that_no_triangle_shows_are_left_out_with_a_margin() {
        let level = Level { width_px: 64, height_px: 64, rgba: vec![[1.0; 4]; 64 * 64] };
        let triangle = [[0.25, 0.25], [0.5, 0.25], [0.25, 0.5]];
        let used_of = |triangles: &[[[f32; 2]; 3]]| used(&level, triangles);
        let used = used_of(&[triangle]).expect("inside");
        let at = |x: usize, y: usize| used[y * 64 + x];
        assert!(at(17, 17) && at(30, 17) && at(17, 30), "inside");
        assert!(at(13, 20) && !at(11, 20) && !at(31, 31) && !at(60, 5), "beside");
        assert_eq!(used_of(&[triangle, [[0.5, 1.5], [0.0, 0.0], [1.0, 0.0]]]), None, "past an edge all may show");
        let all = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert!(used_of(&[all; 16]).is_some() && used_of(&[all; 17]).is_none(), "over and over");
    }

    #[test]
    fn levels_are_means_of_light() {
        let row = [[0.0, 1.0, 0.5, 1.0], [1.0, 1.0, 0.5, 0.0]];
        let level = Level { width_px: 2, height_px: 1, rgba: row.to_vec() };
        let half = halved(&level);
        assert_eq!((half.width_px, half.height_px, half.rgba.as_slice()), (1, 1, [[0.5, 1.0, 0.5, 0.5]].as_slice()));
        assert_eq!((srgb_from_linear(0.5), srgb_from_linear(linear_from_srgb(77.0 / 255.0))), (188, 77));
    }
}
