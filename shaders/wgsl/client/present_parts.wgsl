// The last step of a view at rest whose pixels came in parts: what they leave open shows the background.
#import "client/fullscreen.wgsl"
#import "client/present_uniform.wgsl"

@group(0) @binding(0) var<uniform> present: Present;
// Linear light, and the share of the pixel that is covered.
@group(0) @binding(1) var sum: texture_2d<f32>;
// What the background is seen through (`client/layers.wgsl`), with some samples a pixel; for `show_parts_through` alone.
@group(0) @binding(2) var over_light: texture_2d<f32>;
@group(0) @binding(3) var over_through: texture_2d<f32>;

@fragment
fn show_parts(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let all = textureLoad(sum, vec2i(position.xy), 0);
    let open = select(present.background, present.mark, present.mark_uncovered != 0u);
    let linear = all.rgb + linear_from_srgb(open) * max(1.0 - all.a, 0.0);
    return presented(present, linear, all.a > 0.0);
}

// The same, where the background is seen through something.
@fragment
fn show_parts_through(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let all = textureLoad(sum, pixel, 0);
    let open = linear_from_srgb(select(present.background, present.mark, present.mark_uncovered != 0u));
    let samples = vec2i(textureDimensions(over_light) / textureDimensions(sum));
    var seen = vec3f(0.0);
    var covered = all.a > 0.0;
    for (var y = 0; y < samples.y; y++) {
        for (var x = 0; x < samples.x; x++) {
            let sample = samples * pixel + vec2i(x, y);
            let above = textureLoad(over_light, sample, 0);
            seen += above.rgb + textureLoad(over_through, sample, 0).rgb * open;
            covered = covered || above.a > 0.0;
        }
    }
    let background = seen / f32(samples.x * samples.y);
    return presented(present, all.rgb + background * max(1.0 - all.a, 0.0), covered);
}
