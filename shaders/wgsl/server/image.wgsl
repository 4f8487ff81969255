// What a depth image stores of a fragment, and the redundancy test that drops fragments which earlier images hold:
// Xie, Wang, Popescu 2016, Algorithm 3. The twin on the CPU is `redundancy::Earlier::holds` of the server.
#import "server/scene.wgsl"
#import "common/srgb.wgsl"
#import "common/octahedral.wgsl"

const MAX_EARLIER: u32 = 15u;

struct EarlierImage {
    // Rows of the rigid map from this image's eye to the earlier one's.
    eye_from_this_x: vec4f,
    eye_from_this_y: vec4f,
    eye_from_this_z: vec4f,
    centre_px: vec2f,
    size_px: vec2f,
    focal_px: f32,
    near_m: f32,
    padding_0: f32,
    padding_1: f32,
}

struct EarlierImages {
    count: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    images: array<EarlierImage, MAX_EARLIER>,
}

@group(3) @binding(0) var<uniform> earlier: EarlierImages;
// Layer j holds the ids of image j; 0 where it has no sample.
@group(3) @binding(1) var earlier_ids: texture_2d_array<u32>;

// Whether fragments are tested against earlier images at all.
override non_redundant: bool = false;
// Pixels around the reprojected one that may hold the triangle: 0 is the paper.
override texel_radius: i32 = 0;

struct ImageTargets {
    // Triangle; object (low 16 bits) and octahedral normal (high 16 bits).
    @location(0) ids: vec2u,
    // sRGB-encoded base colour; material code in alpha.
    @location(1) colour: vec4f,
}

fn holds(index: u32, p_eye: vec3f, triangle: u32) -> bool {
    let image = earlier.images[index];
    let p = vec4f(p_eye, 1.0);
    let q = vec3f(dot(image.eye_from_this_x, p), dot(image.eye_from_this_y, p), dot(image.eye_from_this_z, p));
    if q.z < image.near_m {
        return false;
    }
    let place = image.centre_px + image.focal_px / q.z * q.xy;
    if any(place < vec2f(0.0)) || any(place >= image.size_px) {
        return false;
    }
    let texel = vec2i(place);
    let last = vec2i(image.size_px) - 1;
    for (var y = max(texel.y - texel_radius, 0); y <= min(texel.y + texel_radius, last.y); y++) {
        for (var x = max(texel.x - texel_radius, 0); x <= min(texel.x + texel_radius, last.x); x++) {
            if textureLoad(earlier_ids, vec2i(x, y), i32(index), 0).x == triangle {
                return true;
            }
        }
    }
    return false;
}

fn redundant(p_eye: vec3f, triangle: u32) -> bool {
    for (var index = 0u; index < earlier.count; index++) {
        if holds(index, p_eye, triangle) {
            return true;
        }
    }
    return false;
}

fn image_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> ImageTargets {
    var texel: vec4f;
    if non_redundant {
        // Most fragments end here, before the texture is read; derivatives need all of them.
        let dx = dpdx(v.uv);
        let dy = dpdy(v.uv);
        // From the stored depth, so that the test can be repeated from what the image holds.
        let p_eye = pinhole_eye_from_image(camera, v.clip.xy, v.clip.z / camera.near_m);
        if redundant(p_eye, scene_triangle(v, triangle_of_mesh)) {
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
