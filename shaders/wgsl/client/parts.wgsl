// A view at rest whose pixels come in parts: each image is lit by itself, and they are added up in linear light.
#import "client/fullscreen.wgsl"
#import "common/srgb.wgsl"

@group(0) @binding(0) var lit: texture_2d<f32>;
// Its alpha is the share of the pixel that the sample covers.
@group(0) @binding(1) var colour: texture_2d<f32>;

@fragment
fn add(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let shown = textureLoad(lit, pixel, 0);
    let share = textureLoad(colour, pixel, 0).a;
    return vec4f(linear_from_srgb(shown.rgb), 1.0) * share;
}
