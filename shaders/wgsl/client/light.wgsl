// From the G-buffer to the shown colour of every surface, by the look that both ends share.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> lighting: Lighting;
@group(0) @binding(2) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(3) var colour: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
@group(0) @binding(5) var w: texture_2d<f32>;
// The share of the ambient light that arrives, and in each channel that of a light; for `light_occluded` alone. What all arrives of is a
// single texel.
@group(0) @binding(6) var ambient_shares: texture_2d<f32>;
@group(0) @binding(7) var light_shares: texture_2d<f32>;

struct Lit {
    // sRGB-encoded; alpha 1 where there is a surface, else all zero.
    @location(0) colour: vec4f,
    // 1/z in 1/m, 0 where there is no surface.
    @location(1) w: f32,
}

fn lit(position: vec2f, ambient_share: f32, light_share: vec4f) -> Lit {
    let pixel = vec2i(position);
    let base = textureLoad(colour, pixel, 0);
    if base.a == 0.0 {
        return Lit(vec4f(0.0), 0.0);
    }
    let inverse_depth = textureLoad(w, pixel, 0).x;
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let material = material_table[(ids.y >> 16u) & 0xffu];
    let p_eye = pinhole_eye_from_image(camera, position, inverse_depth);
    // The rotation's inverse is its transpose.
    let p_world_axes = p_eye * camera.eye_from_world;
    var normal = octahedral_normal_fine(ids.x);
    if (material.flags & MATERIAL_DOUBLE_SIDED) != 0u && dot(normal, p_world_axes) > 0.0 {
        normal = -normal;
    }
    var arriving = ambient_share * lighting.ambient;
    for (var index = 0u; index < lighting.light_count; index++) {
        var diffuse = diffuse_light(lighting.lights[index], lighting.burley, normal, p_world_axes);
        let shadow = lighting.lights[index].shadow;
        if shadow != 0u {
            diffuse *= light_share[shadow - 1u];
        }
        arriving += diffuse;
    }
    // What the bytes leave off, in quarters of a step.
    let rest = vec3f((vec3u(ids.y) >> vec3u(24u, 26u, 28u)) & vec3u(3u)) / 1020.0;
    let shown = shade_lit(linear_from_srgb(base.rgb + rest), arriving, material);
    return Lit(vec4f(shown, 1.0), inverse_depth);
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
    return lit(position.xy, textureLoad(ambient_shares, ambient_pixel, 0).x, textureLoad(light_shares, light_pixel, 0));
}
