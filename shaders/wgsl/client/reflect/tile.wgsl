// Squares of pixels of the picture, and which walks their rays need. A picture has few rays that are followed, above all after the
// first round: squares without any are not drawn. Software renderers, which run a shader to its end wherever it is drawn, gain most.
#import "client/reflect/ray.wgsl"

// Pixels of a side.
const TILE_PX = 8;
// Rays of the low resolution are this many pixels apart: those at a tile's corners, in the middles of its sides and in its own.
const GUIDE_PX = 4;
// Which of a group of GUIDE_PX x GUIDE_PX pixels its ray is of.
const GUIDE_AT_PX = 2;

// Bits of `in_all`.
const TILE_OUTSIDE = 1u;
const TILE_INSIDE = 2u;

struct Tile {
    // Whether there are rays outside of glass, and within it, that are walked in all impostors.
    in_all: u32,
    // The number of the one impostor that rays meet; 0: none.
    in_one: u32,
    // And where: their parameter, metres.
    from_m: f32,
    to_m: f32,
}

fn tile_texel(tile: Tile) -> vec4u {
    return vec4u(tile.in_all, tile.in_one, bitcast<u32>(tile.from_m), bitcast<u32>(tile.to_m));
}

fn tile_from_texel(texel: vec4u) -> Tile {
    return Tile(texel.x, texel.y, bitcast<f32>(texel.z), bitcast<f32>(texel.w));
}

// The upper left pixel of a tile: rays of the low resolution pass through the corners.
fn tile_corner_px(tile: vec2i) -> vec2i {
    return (tile - 1) * TILE_PX + GUIDE_AT_PX;
}

fn is_pixel(pixel: vec2i, size: vec2i) -> bool {
    return all(pixel >= vec2i(0)) && all(pixel < size);
}

// Which of the bits a ray asks for, by the last word of `RayTexels.first`.
fn tile_bit(history: u32) -> u32 {
    let state = history & 3u;
    return select(0u, TILE_OUTSIDE, state == RAY_OUTSIDE) | select(0u, TILE_INSIDE, state == RAY_INSIDE);
}
