// The picture that a reconstruction is compared with: every fragment is shaded as the client would.
#import "server/scene.wgsl"
#import "common/shade.wgsl"

@group(3) @binding(2) var<uniform> lighting: Lighting;
@group(3) @binding(3) var<uniform> material_table: array<Material, 256>;

struct TruthTargets {
    // Triangle; object.
    @location(0) ids: vec2u,
    // sRGB-encoded picture.
    @location(1) colour: vec4f,
    // None: as the targets of images have it.
    @location(2) rests: vec2u,
}

fn truth_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> TruthTargets {
    let texel = textureSample(base_texture, base_sampler, v.uv);
    let surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    let material = material_table[surface.material];
    var light = lighting.ambient;
    for (var index = 0u; index < lighting.light_count; index++) {
        light += diffuse_light(lighting.lights[index], lighting.burley, surface.normal_world, v.position);
    }
    var out: TruthTargets;
    out.ids = vec2u(surface.triangle, surface.object);
    out.colour = vec4f(shade_lit(surface.base, light, material), 1.0);
    return out;
}
