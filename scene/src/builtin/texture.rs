//! Small repeating pictures of what things are made of. All are sRGB and at most 256 pixels wide.

use crate::model::{Texture, Wrap};
use glam::{Vec3, vec3};

const SIZE: u32 = 256;

/// sRGB `0xRRGGBB` as shares of one.
fn srgb(hex: u32) -> Vec3 {
    vec3(((hex >> 16) & 255) as f32, ((hex >> 8) & 255) as f32, (hex & 255) as f32) / 255.0
}

/// Paints a repeating texture; `at` gets coordinates in `[0, 1)`, from the top left.
fn paint(at: impl Fn(f32, f32) -> Vec3) -> Texture {
    let rgba = (0..SIZE * SIZE)
        .flat_map(|i| {
            let [x, y] = [i % SIZE, i / SIZE].map(|k| (k as f32 + 0.5) / SIZE as f32);
            let c = (at(x, y).clamp(Vec3::ZERO, Vec3::ONE) * 255.0).round();
            [c.x as u8, c.y as u8, c.z as u8, 255]
        })
        .collect();
    Texture { width_px: SIZE, height_px: SIZE, rgba, wrap: [Wrap::Repeat; 2], nearest: false }
}

/// A repeatable number in `[0, 1)` for a lattice cell.
fn hash(x: i32, y: i32, seed: u32) -> f32 {
    let mut h =
        (x as u32).wrapping_mul(0x8da6_b343) ^ (y as u32).wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / (1u32 << 24) as f32
}

/// Smooth noise in `[-1, 1]` with `cells` bumps across the picture, repeating.
fn noise(x: f32, y: f32, cells: i32, seed: u32) -> f32 {
    stretched(x, y, [cells; 2], seed)
}

/// The same with as many bumps along x and y as `cells` says.
fn stretched(x: f32, y: f32, cells: [i32; 2], seed: u32) -> f32 {
    let (x, y) = (x * cells[0] as f32, y * cells[1] as f32);
    let (ix, iy) = (x.floor(), y.floor());
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(x - ix), ease(y - iy));
    let at =
        |dx: i32, dy: i32| hash((ix as i32 + dx).rem_euclid(cells[0]), (iy as i32 + dy).rem_euclid(cells[1]), seed);
    let top = at(0, 0) + (at(1, 0) - at(0, 0)) * u;
    let bottom = at(0, 1) + (at(1, 1) - at(0, 1)) * u;
    (top + (bottom - top) * v) * 2.0 - 1.0
}

/// Three octaves of noise.
fn clouds(x: f32, y: f32, cells: i32, seed: u32) -> f32 {
    (noise(x, y, cells, seed) + 0.5 * noise(x, y, cells * 2, seed + 1) + 0.25 * noise(x, y, cells * 4, seed + 2)) / 1.75
}

/// One tone with cloudy variation of strength `depth` and fine grain.
pub(super) fn mottled(tone: u32, cells: i32, depth: f32) -> Texture {
    paint(|x, y| srgb(tone) * (1.0 + depth * clouds(x, y, cells, tone) + 0.4 * depth * noise(x, y, 96, tone + 9)))
}

/// One tone with dark specks.
pub(super) fn speckled(tone: u32, speck: u32) -> Texture {
    paint(|x, y| {
        let strength = ((noise(x, y, 48, speck) - 0.45) * 4.0).clamp(0.0, 0.7);
        srgb(tone).lerp(srgb(speck), strength) * (1.0 + 0.06 * clouds(x, y, 6, tone))
    })
}

/// Rows of blocks in running bond, `across` by `rows` of them, with joints of `joint` of a block's height.
pub(super) fn brick(block: u32, mortar: u32, [across, rows]: [i32; 2], joint: f32) -> Texture {
    paint(|x, y| {
        let row = (y * rows as f32).floor();
        let shift = if row as i32 % 2 == 0 { 0.0 } else { 0.5 };
        let column = x * across as f32 + shift;
        let (u, v) = (column.fract(), (y * rows as f32).fract());
        let joint_u = joint * across as f32 / rows as f32;
        let grain = 1.0 + 0.05 * noise(x, y, 64, 5);
        if u < joint_u || v < joint {
            return srgb(mortar) * grain;
        }
        let tone = hash((column.floor() as i32).rem_euclid(across), row as i32, block);
        srgb(block) * (0.86 + 0.26 * tone) * grain * (1.0 + 0.05 * clouds(x, y, 8, 3))
    })
}

/// Square tiles in two tones, `count` a side, with joints.
pub(super) fn tiles([a, b]: [u32; 2], joint: u32, count: i32) -> Texture {
    paint(|x, y| {
        let (i, j) = ((x * count as f32) as i32, (y * count as f32) as i32);
        let (u, v) = ((x * count as f32).fract(), (y * count as f32).fract());
        if u.min(v) < 0.03 || u.max(v) > 0.97 {
            return srgb(joint);
        }
        let tone = if (i + j) % 2 == 0 { srgb(a) } else { srgb(b) };
        tone * (0.94 + 0.1 * hash(i, j, 11)) * (1.0 + 0.07 * clouds(x, y, 12, a))
    })
}

/// Boards along v, `count` of them.
pub(super) fn planks(tone: u32, count: i32) -> Texture {
    paint(|x, y| {
        let board = (x * count as f32).floor() as i32;
        let u = (x * count as f32).fract();
        let gap = if !(0.03..=0.97).contains(&u) { 0.55 } else { 1.0 };
        let grain = 0.10 * stretched(x, (y + hash(board, 0, 2)).fract(), [64, 6], 21) + 0.05 * clouds(x, y, 6, 4);
        srgb(tone) * (0.86 + 0.24 * hash(board, 7, tone)) * (1.0 + grain) * gap
    })
}

/// A crate's side: boards inside a frame with a diagonal.
pub(super) fn crate_side(tone: u32) -> Texture {
    paint(|x, y| {
        let edge = x.min(y).min(1.0 - x).min(1.0 - y);
        let frame = edge < 0.13;
        let brace = (x - y).abs() < 0.09;
        let u = (y * 6.0).fract();
        let gap = if !frame && !brace && !(0.05..=0.95).contains(&u) { 0.6 } else { 1.0 };
        let shade = match (frame, brace) {
            (true, _) => 1.08,
            (_, true) => 1.0,
            _ => 0.80 + 0.10 * hash((y * 6.0) as i32, 1, tone),
        };
        let rim = if edge < 0.015 || (0.125..0.135).contains(&edge) { 0.7 } else { 1.0 };
        srgb(tone) * shade * gap * rim * (1.0 + 0.08 * noise(x, y, 40, 8) + 0.06 * clouds(x, y, 5, tone))
    })
}

/// Veined stone.
pub(super) fn marble(tone: u32, vein: u32) -> Texture {
    paint(|x, y| {
        let warp = clouds(x, y, 4, tone);
        let ridge = 1.0 - (noise(x, y, 6, vein) + 0.6 * warp).abs();
        let strength = (ridge.max(0.0).powi(8) * 0.55).min(1.0);
        srgb(tone).lerp(srgb(vein), strength) * (1.0 + 0.05 * warp)
    })
}

/// A road seen from above, u across it: kerb lines, a dashed line in the middle.
pub(super) fn road(tone: u32) -> Texture {
    paint(|x, y| {
        let worn = 1.0 + 0.10 * clouds(x, y, 6, tone) + 0.06 * noise(x, y, 100, 3) + 0.05 * (x * 25.0).sin().powi(2);
        let dash = (x - 0.5).abs() < 0.008 && y < 0.45;
        let line = (x - 0.04).abs() < 0.005 || (x - 0.96).abs() < 0.005;
        if dash || line { srgb(0xd8d4c8) * worn } else { srgb(tone) * worn }
    })
}

/// Stripes along v: where people cross a road.
pub(super) fn crossing(tone: u32) -> Texture {
    paint(|x, y| {
        let worn = 1.0 + 0.10 * clouds(x, y, 6, tone) + 0.06 * noise(x, y, 100, 3);
        if (x * 9.0).fract() < 0.5 && (0.1..0.9).contains(&y) { srgb(0xd8d4c8) * worn } else { srgb(tone) * worn }
    })
}

/// Bark: ridges along v.
pub(super) fn bark(tone: u32) -> Texture {
    paint(|x, y| {
        let ridge = stretched((x + 0.03 * noise(x, y, 6, 2)).rem_euclid(1.0), y, [24, 5], 31);
        srgb(tone) * (1.0 + 0.22 * ridge + 0.10 * clouds(x, y, 8, 6))
    })
}
