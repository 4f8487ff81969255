// A view at rest whose pixels come in parts: each image is lit by itself, and they are added up in linear light.
#import "client/fullscreen.wgsl"
#import "common/srgb.wgsl"

@group(0) @binding(0) var lit: texture_2d<f32>;
// Its alpha is the share of the pixel that the sample covers.
@group(0) @binding(1) var colour: texture_2d<f32>;
// What it is seen through (`client/layers.wgsl`), with some samples a pixel; for `add_through` alone.
@group(0) @binding(2) var over_light: texture_2d<f32>;
@group(0) @binding(3) var over_through: texture_2d<f32>;

@fragment
fn add(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let shown = textureLoad(lit, pixel, 0);
    let share = textureLoad(colour, pixel, 0).a;
    return vec4f(linear_from_srgb(shown.rgb), 1.0) * share;
}

// The same, as it is seen through what lies before it.
@fragment
fn add_through(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let share = textureLoad(colour, pixel, 0).a;
    let linear = linear_from_srgb(textureLoad(lit, pixel, 0).rgb);
    let samples = vec2i(textureDimensions(over_light) / textureDimensions(lit));
    var seen = vec3f(0.0);
    for (var y = 0; y < samples.y; y++) {
        for (var x = 0; x < samples.x; x++) {
            let sample = samples * pixel + vec2i(x, y);
            seen += textureLoad(over_light, sample, 0).rgb + textureLoad(over_through, sample, 0).rgb * linear;
        }
    }
    return vec4f(seen / f32(samples.x * samples.y), 1.0) * share;
}
