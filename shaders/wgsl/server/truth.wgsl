// The picture that a reconstruction is compared with: every fragment is shaded as the client would.
#import "server/scene.wgsl"
#import "common/surface_light.wgsl"

// No uniform: software Vulkan compiles a shader anew for what its branches depend on in uniforms.
@group(3) @binding(2) var<storage, read> lighting: Lighting;
@group(3) @binding(3) var<uniform> material_table: array<Material, 256>;
@group(3) @binding(4) var sky: texture_2d<f32>;

struct TruthTargets {
    // Triangle; object.
    @location(0) ids: vec2u,
    // sRGB-encoded picture.
    @location(1) colour: vec4f,
    // None: as the targets of images have it.
    @location(2) rests: vec2u,
}

fn truth_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> TruthTargets {
    let slopes = slopes_of(v);
    let texel = textureSample(base_texture, base_sampler, v.uv);
    var surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    surface.normal_world = bumped(v, slopes, surface.normal_world);
    surface.material = code_of(v, slopes);
    let seen = Seen(surface.base, surface.normal_world, v.position, -normalize(v.position), 1.0, vec4f(1.0));
    var out: TruthTargets;
    out.ids = vec2u(surface.triangle, surface.object);
    out.colour = vec4f(shown_off(seen, material_table[surface.material]), 1.0);
    return out;
}
