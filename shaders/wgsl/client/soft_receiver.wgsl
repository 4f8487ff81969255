// What a pixel shows, as the frame of a lamp's points sees it: for passes that ask many points at once (`client::soft::batch`). Positions are relative
// to the output eye, with the world's axes.
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

struct Receiver {
    // In the frame's eye space, on the side that is seen.
    normal: vec3f,
    // 0 where there is none.
    own_w: f32,
    // In the frame's image, from its centre.
    image_px: vec2f,
    // What is nearer than this by what the plane rises may hide it.
    least_w: f32,
    // The cosine to the frame's eye, times the distance and the focal length; an eye's shift s changes it by dot(normal.xy, s).
    facing: f32,
    // What the plane rises over some texels, times that.
    rise: f32,
}

fn receiver_at(position: vec4f) -> Receiver {
    let nothing = Receiver(vec3f(0.0), 0.0, vec2f(0.0), 0.0, 0.0, 0.0);
    let pixel = vec2i(position.xy);
    let inverse_depth = textureLoad(w, pixel, 0).x;
    if inverse_depth == 0.0 {
        return nothing;
    }
    let point = pinhole_eye_from_image(camera, position.xy, inverse_depth) * camera.eye_from_world;
    let p = frame.frame_from_view * vec4f(point, 1.0);
    if p.z < frame.near_m {
        return nothing;
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let is_double_sided = (material_table[(ids.y >> 16u) & 0xffu].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    let octahedral = octahedral_normal_fine(ids.x);
    let turned = is_double_sided && dot(octahedral, point) > 0.0;
    let normal = frame.frame_from_view * vec4f(select(octahedral, -octahedral, turned), 0.0);
    let own_w = 1.0 / p.z;
    let facing = -frame.focal_px * dot(normal, p);
    let rise = frame.rise_texels * (abs(normal.x) + abs(normal.y));
    return Receiver(normal, own_w, frame.focal_px * p.xy * own_w, own_w + frame.rounding * own_w, facing, rise);
}
