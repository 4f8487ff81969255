// What a depth image stores of a fragment; fragments which earlier images hold are dropped.
#import "server/scene.wgsl"
#import "server/redundancy.wgsl"
#import "common/srgb.wgsl"
#import "common/octahedral.wgsl"

// Whether fragments are tested against earlier images at all.
override non_redundant: bool = false;

struct ImageTargets {
    // Triangle; object (low 16 bits) and octahedral normal (high 16 bits).
    @location(0) ids: vec2u,
    // sRGB-encoded base colour; material code in alpha.
    @location(1) colour: vec4f,
}

// What an image would hold of a fragment, so that the test can be repeated from what it holds.
fn sample_of(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> Sample {
    let p_eye = pinhole_eye_from_image(camera, v.clip.xy, v.clip.z / camera.near_m);
    let surface = surface_at(v, front_facing, triangle_of_mesh, vec4f(1.0));
    let normal_world = octahedral_normal(octahedral_code(surface.normal_world));
    return Sample(p_eye, normal_world, surface.triangle, surface.object);
}

fn image_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> ImageTargets {
    var texel: vec4f;
    if non_redundant {
        // Most fragments end here, before the texture is read; derivatives need all of them.
        let dx = dpdx(v.uv);
        let dy = dpdy(v.uv);
        if is_redundant(sample_of(v, front_facing, triangle_of_mesh)) {
            discard;
        }
        texel = textureSampleGrad(base_texture, base_sampler, v.uv, dx, dy);
    } else {
        texel = textureSample(base_texture, base_sampler, v.uv);
    }
    let surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    var out: ImageTargets;
    out.ids = vec2u(surface.triangle, surface.object | (octahedral_code(surface.normal_world) << 16u));
    out.colour = vec4f(srgb_from_linear(surface.base), f32(surface.material) / 255.0);
    return out;
}
