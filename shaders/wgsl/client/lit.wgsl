// Surfaces of a G-buffer, or of an image in its formats, as shown: by the look that both ends share.
#import "client/fullscreen.wgsl"
#import "common/octahedral.wgsl"
#import "common/surface_light.wgsl"

@group(0) @binding(1) var<uniform> lighting: Lighting;
@group(0) @binding(2) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(3) var colour: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
@group(0) @binding(5) var w: texture_2d<f32>;
@group(0) @binding(6) var sky: texture_2d<f32>;

struct Lit {
    // sRGB-encoded; alpha 1 where there is a surface, else all zero.
    @location(0) colour: vec4f,
    // Inverse depth in 1/m, 0 where there is no surface.
    @location(1) w: f32,
}

// What is seen at a pixel.
struct Shown {
    // Whether anything is.
    is_there: bool,
    seen: Seen,
    material: Material,
    // How much it hides.
    hides: f32,
}

// A surface at a place relative to the point that the lighting is relative to, seen from where the unit vector `to_eye` points.
fn shown_at(pixel: vec2i, position: vec3f, to_eye: vec3f, ambient_share: f32, light_share: vec4f) -> Shown {
    let base = textureLoad(colour, pixel, 0);
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let material = material_table[(ids.y >> 16u) & 0xffu];
    var normal = octahedral_normal_fine(ids.x);
    if (material.flags & MATERIAL_DOUBLE_SIDED) != 0u && dot(normal, to_eye) < 0.0 {
        normal = -normal;
    }
    // What the bytes leave off, in quarters of a step.
    let rest = vec3f((vec3u(ids.y) >> vec3u(24u, 26u, 28u)) & vec3u(3u)) / 1020.0;
    let seen = Seen(linear_from_srgb(base.rgb + rest), normal, position, to_eye, ambient_share, light_share);
    return Shown(base.a > 0.0, seen, material, base.a);
}

fn lit_at(pixel: vec2i, position: vec3f, to_eye: vec3f, ambient_share: f32, light_share: vec4f) -> Lit {
    let shown = shown_at(pixel, position, to_eye, ambient_share, light_share);
    if !shown.is_there {
        return Lit(vec4f(0.0), 0.0);
    }
    return Lit(vec4f(shown_off(shown.seen, shown.material), 1.0), textureLoad(w, pixel, 0).x);
}
