// Adds the light that rays have brought to what reflectors show: a sum of colours, and of rays.
#import "client/fullscreen.wgsl"
#import "client/reflect/ray.wgsl"
#import "common/shade.wgsl"

@group(0) @binding(0) var first: texture_2d<u32>;
@group(0) @binding(1) var second: texture_2d<u32>;
@group(0) @binding(2) var<uniform> lighting: Lighting;

// Linear colours as shown.
@fragment
fn gather(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let ray = ray_from_texels(textureLoad(first, pixel, 0), textureLoad(second, pixel, 0));
    if ray.state == RAY_NONE {
        discard;
    }
    return vec4f(toned(lighting.exposure * ray.light, lighting.tone), 1.0);
}
