// Which samples of one image the images of a set hold: the redundancy test alone, of an image that is already there.
#import "server/redundancy.wgsl"

@group(1) @binding(0) var sample_ids: texture_2d<u32>;
@group(1) @binding(1) var sample_depth: texture_2d<f32>;
// Row-major: 1 where a sample is redundant. Never cleared, so that calls with further images add to it.
@group(1) @binding(2) var<storage, read_write> redundant: array<u32>;

@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2u(camera.size_px);
    if any(id.xy >= size) {
        return;
    }
    let ids = textureLoad(sample_ids, id.xy, 0).xy;
    if ids.x == 0u {
        return;
    }
    let w = textureLoad(sample_depth, id.xy, 0).x / camera.near_m;
    let p_eye = pinhole_eye_from_image(camera, vec2f(id.xy) + 0.5, w);
    let sample = Sample(p_eye, octahedral_normal(ids.y >> 16u), ids.x, ids.y & 0xffffu);
    if is_redundant(sample) {
        redundant[id.y * size.x + id.x] = 1u;
    }
}
