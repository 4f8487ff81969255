// Which pixels do not see some of a lamp's points, by the maps that `client/compute/warp.wgsl` drew: `client/soft_compare.wgsl` of many at
// once. Positions are relative to the output eye, with the world's axes.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"
#import "client/compute/warp_points.wgsl"
#import "client/compute/warp_frame.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(2) var<uniform> frame: Frame;
@group(0) @binding(3) var<uniform> points: WarpPoints;
@group(0) @binding(4) var w: texture_2d<f32>;
@group(0) @binding(5) var normal_ids: texture_2d<u32>;
// A layer for each of the points.
@group(0) @binding(6) var maps: texture_2d_array<f32>;

@fragment
fn hidden_by_maps(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let sum = hidden_weights(position);
    if all(sum == vec4f(0.0)) {
        discard;
    }
    return sum;
}

// Returns early where nothing is: what is discarded may go on, and pay for the loop.
fn hidden_weights(position: vec4f) -> vec4f {
    let pixel = vec2i(position.xy);
    let inverse_depth = textureLoad(w, pixel, 0).x;
    if inverse_depth == 0.0 {
        return vec4f(0.0);
    }
    let point = pinhole_eye_from_image(camera, position.xy, inverse_depth) * camera.eye_from_world;
    let p = frame.frame_from_view * vec4f(point, 1.0);
    if p.z < frame.near_m {
        return vec4f(0.0);
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let is_double_sided = (material_table[(ids.y >> 16u) & 0xffu].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    let octahedral = octahedral_normal_fine(ids.x);
    let turned = is_double_sided && dot(octahedral, point) > 0.0;
    let normal = frame.frame_from_view * vec4f(select(octahedral, -octahedral, turned), 0.0);
    let own_w = 1.0 / p.z;
    let image_px = frame.focal_px * p.xy * own_w;
    // The cosine to the frame's eye, times the distance and the focal length; an eye's shift changes it by what follows.
    let facing_frame = -frame.focal_px * dot(normal, p);
    // What the plane rises over half a texel, times that.
    let rise = 0.5 * (abs(normal.x) + abs(normal.y));
    let least_w = own_w + frame.rounding * own_w;
    var sum = vec4f(0.0);
    for (var index = 0u; index < points.point_count; index++) {
        let place = points.places[index];
        let at = image_px - place.xy * own_w + place.zw;
        let texel = floor(at);
        let t = vec2i(texel);
        // Places below zero wrap to great ones.
        if all(vec2u(t) < points.size_px) {
            // As in `client/soft_compare.wgsl`, with both sides of the comparison times the cosine.
            let facing = facing_frame + dot(normal.xy, place.xy);
            let caster_w = textureLoad(maps, t, i32(index), 0).x;
            let over = (caster_w - least_w) * facing + dot(normal.xy, texel + 0.5 - at);
            if facing <= 0.0 || (caster_w > 0.0 && over > rise) {
                sum += points.weights[index];
            }
        }
    }
    return sum;
}
