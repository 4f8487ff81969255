// From the G-buffer to the shown colour of every surface, by the look that both ends share.
#import "client/lit.wgsl"
#import "camera/pinhole.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
// The share of the ambient light that arrives, and in each channel that of a light; for `light_occluded` alone. What all arrives of is a
// single texel.
@group(0) @binding(7) var ambient_shares: texture_2d<f32>;
@group(0) @binding(8) var light_shares: texture_2d<f32>;

fn lit(position: vec2f, ambient_share: f32, light_share: vec4f) -> Lit {
    let pixel = vec2i(position);
    let p_eye = pinhole_eye_from_image(camera, position, textureLoad(w, pixel, 0).x);
    // The rotation's inverse is its transpose.
    let p_world_axes = p_eye * camera.eye_from_world;
    return lit_at(pixel, p_world_axes, -normalize(p_world_axes), ambient_share, light_share);
}

@fragment
fn light(@builtin(position) position: vec4f) -> Lit {
    return lit(position.xy, 1.0, vec4f(1.0));
}

@fragment
fn light_occluded(@builtin(position) position: vec4f) -> Lit {
    let pixel = vec2i(position.xy);
    let ambient_pixel = min(pixel, vec2i(textureDimensions(ambient_shares)) - 1);
    let light_pixel = min(pixel, vec2i(textureDimensions(light_shares)) - 1);
    let ambient_share = mix(1.0, textureLoad(ambient_shares, ambient_pixel, 0).x, lighting.occlusion_strength);
    let light_share = mix(vec4f(1.0), textureLoad(light_shares, light_pixel, 0), lighting.shadow_strength);
    return lit(position.xy, ambient_share, light_share);
}
