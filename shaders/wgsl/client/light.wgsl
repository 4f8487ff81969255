// From the G-buffer to the shown colour of every surface, by the look that both ends share.
#import "client/lit.wgsl"
#import "camera/pinhole.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
// The share of the ambient light that arrives, and in each channel that of a light; for `light_occluded` alone. What all arrives of is a
// single texel.
@group(0) @binding(7) var ambient_shares: texture_2d<f32>;
@group(0) @binding(8) var light_shares: texture_2d<f32>;

// Relative to the eye, world axes.
fn place_of(position: vec2f) -> vec3f {
    let p_eye = pinhole_eye_from_image(camera, position, textureLoad(w, vec2i(position), 0).x);
    // The rotation's inverse is its transpose.
    return p_eye * camera.eye_from_world;
}

fn lit(position: vec2f, ambient_share: f32, light_share: vec4f) -> Lit {
    let place = place_of(position);
    return lit_at(vec2i(position), place, -normalize(place), ambient_share, light_share);
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

// A surface that is seen through.
struct LitLayer {
    // Its own light as shown, times what it hides: sRGB-encoded.
    @location(0) colour: vec4f,
    // Inverse depth in 1/m, 0 where there is no surface.
    @location(1) w: f32,
    // The share of what lies behind it that is seen, linear RGB.
    @location(2) through: vec4f,
}

@fragment
fn light_layer(@builtin(position) position: vec4f) -> LitLayer {
    let pixel = vec2i(position.xy);
    let place = place_of(position.xy);
    let shown = shown_at(pixel, place, -normalize(place), 1.0, vec4f(1.0));
    if !shown.is_there {
        return LitLayer(vec4f(0.0), 0.0, vec4f(1.0));
    }
    let own = linear_from_srgb(shown_off(shown.seen, shown.material)) * shown.hides;
    let through = mix(vec3f(1.0), light_through(shown.seen, shown.material), shown.hides);
    return LitLayer(vec4f(srgb_from_linear(own), 1.0), textureLoad(w, pixel, 0).x, vec4f(through, 1.0));
}
