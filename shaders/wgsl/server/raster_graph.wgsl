// Entry points of the pass that draws what one frustum of a graph camera holds.
#import "server/pull.wgsl"
#import "server/targets.wgsl"

struct GraphFrustum {
    // Takes a point relative to the centre to (u q, v q, q); w is 1/q up to a factor.
    image_from_offset: mat3x3f,
    size_px: vec2f,
    // What the depth buffer holds is this over q: the image's nearest w is 1, in every frustum alike.
    depth_q: f32,
    plane_count: u32,
    // How far outside of a plane rounding can put a point on it, per metre of its offset, and at the centre.
    slack_per_m: f32,
    slack_m: f32,
    padding_0: f32,
    padding_1: f32,
    // Outward, and how far the plane lies from the centre.
    planes: array<vec4f, 33>,
}

@group(3) @binding(0) var<uniform> frustum: GraphFrustum;

@vertex
fn vertex(@builtin(vertex_index) place: u32, @builtin(instance_index) instance: u32) -> Varying {
    // The eye of the pass is the frustum's centre.
    var v = pulled_corner(place, instance);
    let image = frustum.image_from_offset * v.position;
    let doubled = 2.0 * image.xy / frustum.size_px;
    v.clip = vec4f(doubled.x - image.z, image.z - doubled.y, frustum.depth_q, image.z);
    return v;
}

fn is_in_frustum(offset: vec3f) -> bool {
    let size_m = abs(offset.x) + abs(offset.y) + abs(offset.z);
    let slack_m = frustum.slack_m + frustum.slack_per_m * size_m;
    for (var index = 0u; index < frustum.plane_count; index++) {
        let plane = frustum.planes[index];
        if dot(plane.xyz, offset) - plane.w > slack_m {
            return false;
        }
    }
    return true;
}

@fragment
fn plain(v: Varying, @builtin(front_facing) front: bool) -> ImageTargets {
    let targets = plain_fragment(v, front, v.triangle);
    if !is_in_frustum(v.position) {
        discard;
    }
    return targets;
}
