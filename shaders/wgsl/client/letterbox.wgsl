// A lit image of any camera, as large as the output holds it whole.
#import "client/fullscreen.wgsl"
#import "common/srgb.wgsl"

// The twin of `LetterboxUniform` of the client.
struct Letterbox {
    // sRGB-encoded, around the image.
    background: vec3f,
    // 1: the target encodes sRGB itself.
    target_encodes: u32,
    // sRGB-encoded, where the image shows nothing.
    empty: vec3f,
    // 1: alpha is 1 where there is a surface and 0 elsewhere; otherwise it is 1 everywhere.
    coverage_in_alpha: u32,
    // Where in the output the image begins, in its pixels.
    first_px: vec2f,
    // Pixels of the image along a side of one of the output.
    texels_per_px: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> letterbox: Letterbox;
@group(0) @binding(1) var lit: texture_2d<f32>;

// A pixel of an image that is made smaller is the mean of no more than so many texels along a side.
const MOST_TEXELS: f32 = 16.0;

fn presented(encoded: vec3f, is_covered: bool) -> vec4f {
    let alpha = select(0.0, 1.0, is_covered || letterbox.coverage_in_alpha == 0u);
    return vec4f(select(encoded, linear_from_srgb(encoded), letterbox.target_encodes != 0u), alpha);
}

@fragment
fn show_letterbox(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = (position.xy - letterbox.first_px) * letterbox.texels_per_px;
    let size = vec2f(textureDimensions(lit));
    if any(at < vec2f(0.0)) || any(at >= size) {
        return presented(letterbox.background, false);
    }
    let nearest = textureLoad(lit, vec2i(at), 0);
    if letterbox.texels_per_px == 1.0 && all(fract(at) == vec2f(0.5)) {
        return presented(select(letterbox.empty, nearest.rgb, nearest.a > 0.0), nearest.a > 0.0);
    }
    // A tent as wide as two texels, or as two pixels of the output where these are larger: in between it is bilinear.
    let reach = clamp(letterbox.texels_per_px, 1.0, MOST_TEXELS / 2.0);
    let low = vec2i(ceil(at - reach - 0.5));
    let high = vec2i(floor(at + reach - 0.5));
    var linear = vec3f(0.0);
    var weights = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let away = 1.0 - abs(vec2f(vec2i(x, y)) + 0.5 - at) / reach;
            let weight = max(away.x, 0.0) * max(away.y, 0.0);
            let texel = textureLoad(lit, clamp(vec2i(x, y), vec2i(0), vec2i(size) - 1), 0);
            linear += weight * linear_from_srgb(select(letterbox.empty, texel.rgb, texel.a > 0.0));
            weights += weight;
        }
    }
    return presented(srgb_from_linear(linear / weights), nearest.a > 0.0);
}
