// A depth image that rays are intersected with: the twin of `impostor::Impostor`. Points are relative to an anchor, metres,
// world axes. Only textureLoad, constant loop bounds and no storage, so that it runs on WebGL2.

// The least inverse depth of no pixel, and the negative of the greatest: more than any other, and a number, as an f32 goes up to 3.4e38.
const IMPOSTOR_NOWHERE = 3e38;

struct Impostor {
    bounds_min_anchor: vec3f,
    // The range of inverse depths of the whole image.
    w_min: f32,
    bounds_max_anchor: vec3f,
    w_max: f32,
    size_px: vec2f,
    // An upper bound of a fine step's length, at most 1.
    fine_px: f32,
    // The coarsest level of the ranges.
    top_level: u32,
    // The push of a single-pole camera; `push_max_px` is 0 for every other one.
    pole_px: vec2f,
    push_from_w: f32,
    push_to_w: f32,
    push_max_px: f32,
    ramp_px: f32,
    padding_0: f32,
    padding_1: f32,
}

// The planes of the pixels: (w, its slope per pixel along u and v, a footprint in w); all zero where nothing is held.
fn impostor_texel(texels: texture_2d<f32>, pixel: vec2i) -> vec4f {
    let size = vec2i(textureDimensions(texels));
    if any(pixel < vec2i(0)) || any(pixel >= size) {
        return vec4f(0.0);
    }
    return textureLoad(texels, pixel, 0);
}

// By how much the inverse depth of (u, v, w) is greater than that of a pixel's plane there: positive before the surface.
fn impostor_ahead_w(texel: vec4f, pixel: vec2i, image: vec3f) -> f32 {
    return image.z - (texel.x + dot(texel.yz, image.xy - vec2f(pixel) - 0.5));
}

// Whether two pixels show one surface: `w` rises between their centres as much as a slope between theirs says, or a footprint
// more or less.
fn impostor_is_one_surface(a: vec4f, b: vec4f, pixels_from_a_to_b: vec2i) -> bool {
    let way_px = vec2f(pixels_from_a_to_b);
    let by_a = dot(a.yz, way_px);
    let by_b = dot(b.yz, way_px);
    let gap_w = max(a.w, b.w);
    let rise = b.x - a.x;
    return rise >= min(by_a, by_b) - gap_w && rise <= max(by_a, by_b) + gap_w;
}

// (least, greatest) inverse depth of a block of 2^level pixels. The levels lie in one texture, as mipmaps would not do: software
// rasterizers choose one mipmap for four fragments at once, even for textureLoad. The pixels are a square on the left, its side a
// power of two; the blocks of every further level stand below those of the one before, from the top right on.
fn impostor_range(ranges: texture_2d<f32>, level: u32, block: vec2i) -> vec2f {
    let side = i32(textureDimensions(ranges).y);
    if level == 0u {
        return textureLoad(ranges, block, 0).xy;
    }
    return textureLoad(ranges, vec2i(side, side - (side >> (level - 1u))) + block, 0).xy;
}

// The same of the pixels that a box touches, and some around: the least is greater where there are none.
fn impostor_range_over(impostor: Impostor, ranges: texture_2d<f32>, min_px: vec2f, max_px: vec2f) -> vec2f {
    let is_outside = any(max_px < vec2f(0.0)) || any(min_px >= impostor.size_px);
    if is_outside {
        return vec2f(IMPOSTOR_NOWHERE, -IMPOSTOR_NOWHERE);
    }
    let extent_px = max(max(max_px.x - min_px.x, max_px.y - min_px.y), 1.0);
    // A hair more, as log2 is not exact: a box must not touch three blocks in a row. WGSL has it right to 3 units in the last place, 3e-6 of numbers from 8 to 16;
    // log2(1.0001) is 1.4e-4, fifty times that.
    let level = min(u32(ceil(log2(extent_px * 1.0001))), impostor.top_level);
    let block_px = f32(1u << level);
    let last = vec2i((i32(textureDimensions(ranges).y) >> level) - 1);
    let low = clamp(vec2i(floor(min_px / block_px)), vec2i(0), last);
    let high = clamp(vec2i(floor(max_px / block_px)), vec2i(0), last);
    let a = impostor_range(ranges, level, low);
    let b = impostor_range(ranges, level, vec2i(high.x, low.y));
    let c = impostor_range(ranges, level, vec2i(low.x, high.y));
    let d = impostor_range(ranges, level, high);
    return vec2f(min(min(a.x, b.x), min(c.x, d.x)), max(max(a.y, b.y), max(c.y, d.y)));
}
