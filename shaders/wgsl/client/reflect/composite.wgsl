// Reflectors as shown: the mean of what the rays of each pixel have brought.
#import "client/fullscreen.wgsl"
#import "common/srgb.wgsl"

// Of the rays of a pixel: linear colours, and how many there are.
@group(0) @binding(0) var sum: texture_2d<f32>;

// sRGB-encoded; alpha 0 where there is no reflector.
fn shown(pixel: vec2i) -> vec4f {
    let texel = textureLoad(sum, pixel, 0);
    return vec4f(srgb_from_linear(texel.rgb / max(texel.a, 1.0)), texel.a);
}

// Colours that differ by more than this, of sRGB-encoded ones from 0 to 1, have an edge between them: fifteen steps of an 8-bit
// picture, which one pixel of a gradient seldom makes, and where a jagged edge begins to be seen.
const LEAST_EDGE = 0.06;

// 1 where a neighbour on the reflector shows something else.
@fragment
fn edges(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let own = shown(pixel);
    let last = vec2i(textureDimensions(sum)) - 1;
    var most = 0.0;
    for (var index = 0; index < 9; index++) {
        let beside = shown(clamp(pixel + vec2i(index % 3, index / 3) - 1, vec2i(0), last));
        let difference = abs(beside.rgb - own.rgb) * min(own.a, beside.a);
        most = max(most, max(difference.r, max(difference.g, difference.b)));
    }
    return vec4f(select(0.0, 1.0, most > LEAST_EDGE));
}

@fragment
fn composite(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let own = shown(vec2i(position.xy));
    if own.a == 0.0 {
        discard;
    }
    return vec4f(own.rgb, 1.0);
}
