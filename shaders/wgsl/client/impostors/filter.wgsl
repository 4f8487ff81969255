// What a hit shows, between the samples around it: of one surface, and of as many as an output pixel spans. Averages over
// blocks of 2x2, 4x4 and so on lie in one texture, as those of `impostor_range` do and for the same reason.
#import "common/octahedral.wgsl"
#import "common/srgb.wgsl"
#import "impostor/crossing.wgsl"

struct Look {
    // sRGB-encoded base colour.
    colour: vec3f,
    // At capture.
    normal: vec3f,
    // The sine of the angle between the impostor camera's ray and the surface.
    facing: f32,
}

// How wide a sample is, in metres, and its facing: the upper half of an f32, and 16 bits, beside the code of its normal.
fn footprint_of(shape: vec2u) -> f32 {
    return bitcast<f32>(shape.y & 0xffff0000u);
}

fn facing_of(shape: vec2u) -> f32 {
    return f32(shape.y & 0xffffu) / 65535.0;
}

// The colour of a block of 2^level pixels; alpha is its material for one pixel, and for more 1 where they hold anything.
fn block_colour(colours: texture_2d<f32>, level: i32, block: vec2i) -> vec4f {
    if level == 0 {
        return textureLoad(colours, block, 0);
    }
    let side = i32(textureDimensions(colours).y);
    return textureLoad(colours, vec2i(side, side - (side >> u32(level - 1))) + block, 0);
}

// The share of one of the four blocks around a place.
fn bilinear_share(part: vec2f, step: vec2i) -> f32 {
    let share = select(1.0 - part, part, step == vec2i(1));
    return share.x * share.y;
}

// Between the four samples around, of those that show the same surface.
fn smooth_look(planes: texture_2d<f32>, shapes: texture_2d<u32>, colours: texture_2d<f32>, hit: ImpostorHit) -> Look {
    let own_plane = impostor_texel(planes, hit.pixel);
    let own = textureLoad(colours, hit.pixel, 0);
    let own_shape = textureLoad(shapes, hit.pixel, 0).xy;
    let own_normal = octahedral_normal_fine(own_shape.x);
    let corner = floor(hit.image.xy - 0.5);
    let part = hit.image.xy - 0.5 - corner;
    var sum = vec4f(0.0);
    var normal = vec3f(0.0);
    var facing = 0.0;
    for (var index = 0; index < 4; index++) {
        let step = vec2i(index & 1, index >> 1u);
        let pixel = vec2i(corner) + step;
        let plane = impostor_texel(planes, pixel);
        if plane.x > 0.0 && impostor_is_one_surface(own_plane, plane, pixel - hit.pixel) {
            let texel = textureLoad(colours, pixel, 0);
            let share = bilinear_share(part, step) * select(0.0, 1.0, texel.a == own.a);
            sum += vec4f(linear_from_srgb(texel.rgb), 1.0) * share;
            let shape = textureLoad(shapes, pixel, 0).xy;
            normal += octahedral_normal_fine(shape.x) * share;
            facing += facing_of(shape) * share;
        }
    }
    // Opposite normals of a thin sheet sum up to none.
    if sum.a <= 0.0 || dot(normal, own_normal) <= 0.0 {
        return Look(own.rgb, own_normal, facing_of(own_shape));
    }
    return Look(srgb_from_linear(sum.rgb / sum.a), normalize(normal), facing / sum.a);
}

// Between the four blocks around, of those that hold anything.
fn block_look(shapes: texture_2d<u32>, colours: texture_2d<f32>, hit: ImpostorHit, level: i32) -> Look {
    let place = hit.image.xy / f32(1u << u32(level)) - 0.5;
    let corner = floor(place);
    let last = vec2i((i32(textureDimensions(colours).y) >> u32(level)) - 1);
    var sum = vec4f(0.0);
    for (var index = 0; index < 4; index++) {
        let step = vec2i(index & 1, index >> 1u);
        let texel = block_colour(colours, level, clamp(vec2i(corner) + step, vec2i(0), last));
        sum += vec4f(linear_from_srgb(texel.rgb), 1.0) * (bilinear_share(place - corner, step) * texel.a);
    }
    // The block of the hit is one of the four, and holds it, with a quarter of the weight at least: any number does that is smaller.
    let colour = srgb_from_linear(sum.rgb / max(sum.a, 1e-6));
    let shape = textureLoad(shapes, hit.pixel, 0).xy;
    return Look(colour, octahedral_normal_fine(shape.x), facing_of(shape));
}

// Where an output pixel shows `shown_px` of the impostor's pixels.
fn filtered_look(
    planes: texture_2d<f32>,
    shapes: texture_2d<u32>,
    colours: texture_2d<f32>,
    hit: ImpostorHit,
    shown_px: f32,
) -> Look {
    let top = i32(round(log2(f32(textureDimensions(colours).y))));
    let level = clamp(i32(round(log2(max(shown_px, 1.0)))), 0, top);
    if level == 0 {
        return smooth_look(planes, shapes, colours, hit);
    }
    return block_look(shapes, colours, hit, level);
}
