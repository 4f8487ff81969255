// The fragments of a depth image; those which earlier images hold are dropped.
#import "server/targets.wgsl"
#import "server/redundancy.wgsl"

// Whether fragments are tested against earlier images at all.
override non_redundant: bool = false;

// What an image would hold of a fragment, so that the test can be repeated from what it holds.
fn sample_of(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> Sample {
    let p_eye = pinhole_eye_from_image(camera, v.clip.xy, v.clip.z / camera.near_m);
    let surface = surface_at(v, front_facing, triangle_of_mesh, vec4f(1.0));
    let normal_world = octahedral_normal(octahedral_code(surface.normal_world));
    return Sample(p_eye, normal_world, surface.triangle, surface.object);
}

fn image_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> ImageTargets {
    if !non_redundant {
        return plain_fragment(v, front_facing, triangle_of_mesh);
    }
    // Most fragments end here, before the texture is read; derivatives need all of them.
    let slopes = slopes_of(v);
    let sample = sample_of(v, front_facing, triangle_of_mesh);
    // What only hides is no sample that an image could hold.
    if sample.triangle != 0u && is_redundant(sample) {
        discard;
    }
    let texel = textureSampleGrad(base_texture, base_sampler, v.uv, slopes.dx_uv, slopes.dy_uv);
    var surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    surface.normal_world = bumped(v, slopes, surface.normal_world);
    surface.material = code_of(v, slopes);
    return targets_of(surface);
}
