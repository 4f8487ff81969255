// Where rays of a low resolution tell what those between them meet: the first of two passes.
//
// Method: Rosen and others, *Non-pinhole approximations for interactive rendering*, section 7.2, which envisions reflections at a lower
// resolution first, and intersections "only at regions where the lower resolution results are not sufficient". There results are
// interpolated in coherent regions. Here every ray is still intersected, but in one impostor and between the depths that the rays around
// say; what finds nothing there is walked as elsewhere. Where an edge lies between them, these are far apart.
#import "client/fullscreen.wgsl"
#import "client/reflect/found.wgsl"
#import "client/reflect/tile.wgsl"

@group(0) @binding(0) var first: texture_2d<u32>;
// Of rays of the low resolution (t's bits, the impostor's number, the bits of its samples' footprint there); or what the guided ones found.
@group(0) @binding(1) var met: texture_2d<u32>;
@group(0) @binding(2) var tiles: texture_2d<u32>;

struct Guide {
    t: f32,
    number: u32,
    footprint_m: f32,
    history: u32,
}

fn guide(place: vec2i) -> Guide {
    let last = vec2i(textureDimensions(met)) - 1;
    let inside = clamp(place, vec2i(0), last);
    let texel = textureLoad(met, inside, 0);
    let pixel = min(inside * GUIDE_PX + GUIDE_AT_PX, vec2i(textureDimensions(first)) - 1);
    return Guide(bitcast<f32>(texel.x), texel.y, bitcast<f32>(texel.z), textureLoad(first, pixel, 0).w);
}

// How far from even three depths in a row rise, in metres.
fn bend_m(a: f32, b: f32, c: f32) -> f32 {
    return abs(a - 2.0 * b + c);
}

// Of nine rays around a tile, row by row: from where to where lies what those between meet, if it bends no more than these say. A parabola
// through three depths leaves them by an eighth of the bend, and a sample may lie a footprint off.
fn range_m(t: array<f32, 9>, footprint_m: f32) -> vec2f {
    var depths = t;
    var least = depths[0];
    var greatest = depths[0];
    for (var index = 1; index < 9; index++) {
        least = min(least, depths[index]);
        greatest = max(greatest, depths[index]);
    }
    var across = 0.0;
    var down = 0.0;
    for (var line = 0; line < 3; line++) {
        across = max(across, bend_m(depths[3 * line], depths[3 * line + 1], depths[3 * line + 2]));
        down = max(down, bend_m(depths[line], depths[line + 3], depths[line + 6]));
    }
    let margin = (across + down) / 8.0 + footprint_m;
    return vec2f(max(least - margin, 0.0), greatest + margin);
}

// A tile whose nine rays meet one impostor, and whose pixels all have the history of these.
@fragment
fn guided_tiles(@builtin(position) position: vec4f) -> @location(0) vec4u {
    let place = vec2i(position.xy);
    let corner = tile_corner_px(place);
    let size = vec2i(textureDimensions(first));
    let middle = guide(place * 2 - 1);
    var is_one = middle.number != 0u;
    var footprint_m = 0.0;
    var t: array<f32, 9>;
    for (var index = 0; index < 9; index++) {
        let other = guide(place * 2 - 2 + vec2i(index % 3, index / 3));
        is_one = is_one && other.number == middle.number && other.history == middle.history;
        t[index] = other.t;
        footprint_m = max(footprint_m, other.footprint_m);
    }
    var in_all = 0u;
    for (var index = 0; index < TILE_PX * TILE_PX; index++) {
        let pixel = corner + vec2i(index % TILE_PX, index / TILE_PX);
        if is_pixel(pixel, size) {
            let history = textureLoad(first, pixel, 0).w;
            in_all |= tile_bit(history);
            is_one = is_one && history == middle.history;
        }
    }
    let range = range_m(t, footprint_m);
    if is_one && in_all != 0u {
        return tile_texel(Tile(0u, middle.number, range.x, range.y));
    }
    return tile_texel(Tile(in_all, 0u, 0.0, 0.0));
}

// What is left after the guided walks: tiles that were not guided, and those where a ray found nothing.
@fragment
fn tiles_left(@builtin(position) position: vec4f) -> @location(0) vec4u {
    let place = vec2i(position.xy);
    let tile = tile_from_texel(textureLoad(tiles, place, 0));
    let corner = tile_corner_px(place);
    let size = vec2i(textureDimensions(first));
    var in_all = tile.in_all;
    for (var index = 0; index < TILE_PX * TILE_PX; index++) {
        let pixel = corner + vec2i(index % TILE_PX, index / TILE_PX);
        if is_pixel(pixel, size) && found_from_texel(textureLoad(met, pixel, 0)).weight == 0.0 {
            in_all |= tile_bit(textureLoad(first, pixel, 0).w);
        }
    }
    return tile_texel(Tile(in_all, 0u, 0.0, 0.0));
}
