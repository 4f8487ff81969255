// What a depth image stores of a fragment.
#import "server/scene.wgsl"
#import "common/srgb.wgsl"
#import "common/octahedral.wgsl"

struct ImageTargets {
    // Triangle; object (low 16 bits) and octahedral normal (high 16 bits).
    @location(0) ids: vec2u,
    // sRGB-encoded base colour; material code in alpha.
    @location(1) colour: vec4f,
    // Where normals are kept finely, what the code of the normal leaves off; else 0.
    @location(2) normal_rest: u32,
}

fn targets_of(surface: Surface) -> ImageTargets {
    var out: ImageTargets;
    out.ids = vec2u(surface.triangle, surface.object | (octahedral_code(surface.normal_world) << 16u));
    out.colour = vec4f(srgb_from_linear(surface.base), f32(surface.material) / 255.0);
    out.normal_rest = select(0u, octahedral_rest(surface.normal_world), surface.fine_normal);
    return out;
}

// Of an image by itself, which no earlier one is asked about.
fn plain_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> ImageTargets {
    let texel = textureSample(base_texture, base_sampler, v.uv);
    let surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    return targets_of(surface);
}
