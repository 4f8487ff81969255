// The last step of a view at rest whose pixels came in parts: what they leave open shows the background.
#import "client/fullscreen.wgsl"
#import "client/present_uniform.wgsl"

@group(0) @binding(0) var<uniform> present: Present;
// Linear light, and the share of the pixel that is covered.
@group(0) @binding(1) var sum: texture_2d<f32>;

@fragment
fn show_parts(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let all = textureLoad(sum, vec2i(position.xy), 0);
    let open = select(present.background, present.mark, present.mark_uncovered != 0u);
    let linear = all.rgb + linear_from_srgb(open) * max(1.0 - all.a, 0.0);
    return presented(present, linear, all.a > 0.0);
}
