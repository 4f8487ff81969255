// What a depth image stores of a fragment.
#import "server/scene.wgsl"
#import "common/srgb.wgsl"
#import "common/octahedral.wgsl"

struct ImageTargets {
    // Triangle; object (low 16 bits) and octahedral normal (high 16 bits).
    @location(0) ids: vec2u,
    // sRGB-encoded base colour; material code in alpha.
    @location(1) colour: vec4f,
    // What the codes of the normal and of the colour leave off, where those are kept finely; else 0. In place of the latter, how much it hides, in a layer.
    @location(2) rests: vec2u,
}

fn targets_of(surface: Surface) -> ImageTargets {
    var out: ImageTargets;
    out.ids = vec2u(surface.triangle, surface.object | (octahedral_code(surface.normal_world) << 16u));
    let srgb = srgb_from_linear(surface.base);
    out.colour = vec4f(srgb, f32(surface.material) / 255.0);
    out.rests.x = select(0u, octahedral_rest(surface.normal_world), (surface.fine & FINE_NORMAL) != 0u);
    if (surface.fine & FINE_COLOUR) != 0u {
        let quarters = vec3u(round(1020.0 * srgb));
        out.colour = vec4f(vec3f(quarters >> vec3u(2u)) / 255.0, out.colour.a);
        let rest = quarters & vec3u(3u);
        out.rests.y = rest.x | (rest.y << 2u) | (rest.z << 4u);
    }
    if surface.hides != 0u {
        out.rests.y = surface.hides;
    }
    return out;
}

// Of an image by itself, which no earlier one is asked about.
fn plain_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> ImageTargets {
    let slopes = slopes_of(v);
    let texel = textureSample(base_texture, base_sampler, v.uv);
    var surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    surface.normal_world = bumped(v, slopes, surface.normal_world);
    surface.material = code_of(v, slopes);
    return targets_of(surface);
}
