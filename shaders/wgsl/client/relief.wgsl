// The eye's rays against an impostor, in every place where an object is shown by it: a box around each, instanced. The twin of
// `relief::instances::InstanceVertex`.
#import "camera/pinhole.wgsl"
#import "client/impostors/filter.wgsl"
#import "impostor/pinhole.wgsl"

// The output; the eye is its anchor.
@group(0) @binding(0) var<uniform> view: Pinhole;
@group(0) @binding(1) var<uniform> image: Impostor;
// What took the impostor.
@group(0) @binding(2) var<uniform> camera: Pinhole;
@group(0) @binding(3) var planes: texture_2d<f32>;
@group(0) @binding(4) var ranges: texture_2d<f32>;
@group(0) @binding(5) var shapes: texture_2d<u32>;
@group(0) @binding(6) var colours: texture_2d<f32>;

// Corners of one strip of triangles around a box: a bit each, 1 on the greater side.
const STRIP_X = 0x287au;
const STRIP_Y = 0x02afu;
const STRIP_Z = 0x31e3u;

// A ray may come out from behind a surface so often before it counts as lost.
const FRONT_LEGS = 4;

struct Instance {
    // Rows of the affine map from the output eye to where the impostor was captured, relative to the anchor; and back.
    @location(0) anchor_from_eye_x: vec4f,
    @location(1) anchor_from_eye_y: vec4f,
    @location(2) anchor_from_eye_z: vec4f,
    @location(3) eye_from_anchor_x: vec4f,
    @location(4) eye_from_anchor_y: vec4f,
    @location(5) eye_from_anchor_z: vec4f,
    // Linear RGB, and 1 where the map turns left to right.
    @location(6) tint_mirrored: vec4f,
    @location(7) object: u32,
}

struct Box {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) anchor_from_eye_x: vec4f,
    @location(1) @interpolate(flat, either) anchor_from_eye_y: vec4f,
    @location(2) @interpolate(flat, either) anchor_from_eye_z: vec4f,
    @location(3) @interpolate(flat, either) tint: vec3f,
    @location(4) @interpolate(flat, either) object: u32,
}

// As `Surface` of `surface/quads.wgsl`, with the depth that is tested.
struct Relief {
    @location(0) colour: vec4f,
    @location(1) normal_ids: vec2u,
    @location(2) w: f32,
    // 0 where nothing is met.
    @builtin(frag_depth) depth: f32,
}

@vertex
fn box(@builtin(vertex_index) index: u32, in: Instance) -> Box {
    let bits = (vec3u(STRIP_X, STRIP_Y, STRIP_Z) >> vec3u(index)) & vec3u(1u);
    // In a mirror triangles run the other way round; along the other way of one axis they run as before.
    let corner = vec3f(abs(f32(bits.x) - in.tint_mirrored.w), f32(bits.y), f32(bits.z));
    let p_anchor = vec4f(mix(image.bounds_min_anchor, image.bounds_max_anchor, corner), 1.0);
    let p_eye = vec3f(
        dot(in.eye_from_anchor_x, p_anchor),
        dot(in.eye_from_anchor_y, p_anchor),
        dot(in.eye_from_anchor_z, p_anchor),
    );
    var out: Box;
    out.clip = pinhole_clip_from_eye(view, p_eye);
    out.anchor_from_eye_x = in.anchor_from_eye_x;
    out.anchor_from_eye_y = in.anchor_from_eye_y;
    out.anchor_from_eye_z = in.anchor_from_eye_z;
    out.tint = in.tint_mirrored.rgb;
    out.object = in.object;
    return out;
}

// A pixel's ray, where the impostor was captured: t is the depth before the output eye, metres.
fn eye_ray(in: Box) -> ImpostorRay {
    let way_eye = pinhole_ray(view, in.clip.xy);
    let way = vec3f(
        dot(in.anchor_from_eye_x.xyz, way_eye),
        dot(in.anchor_from_eye_y.xyz, way_eye),
        dot(in.anchor_from_eye_z.xyz, way_eye),
    );
    let origin = vec3f(in.anchor_from_eye_x.w, in.anchor_from_eye_y.w, in.anchor_from_eye_z.w);
    return ImpostorRay(origin, view.near_m, way, 3e38);
}

fn footprint_m(hit: ImpostorHit) -> f32 {
    return footprint_of(textureLoad(shapes, hit.pixel, 0).xy);
}

// The first surface that the ray meets from where the impostor's camera looked.
fn front_hit(ray: ImpostorRay) -> ImpostorHit {
    var leg = ray;
    for (var index = 0; index < FRONT_LEGS; index++) {
        let hit = impostor_hit_of_pinhole(image, camera, planes, ranges, leg);
        if hit.side != IMPOSTOR_BACK {
            return hit;
        }
        leg.t_from = hit.t + footprint_m(hit) / length(ray.direction);
    }
    return impostor_miss(0u);
}

// How wide a pixel of the output is at a depth, in metres where the impostor was captured.
fn shown_m(in: Box, z_m: f32) -> f32 {
    let across = vec3f(in.anchor_from_eye_x.x, in.anchor_from_eye_y.x, in.anchor_from_eye_z.x);
    let down = vec3f(in.anchor_from_eye_x.y, in.anchor_from_eye_y.y, in.anchor_from_eye_z.y);
    return max(length(across), length(down)) * z_m / view.focal_px;
}

fn surface_met(in: Box, hit: ImpostorHit) -> Relief {
    let look = filtered_look(planes, shapes, colours, hit, shown_m(in, hit.t) / footprint_m(hit));
    // Normals go by the transpose of the inverse's inverse.
    let normal_eye = in.anchor_from_eye_x.xyz * look.normal.x
        + in.anchor_from_eye_y.xyz * look.normal.y
        + in.anchor_from_eye_z.xyz * look.normal.z;
    let material = u32(textureLoad(colours, hit.pixel, 0).a * 255.0 + 0.5);
    let colour = srgb_from_linear(linear_from_srgb(look.colour) * in.tint);
    let normal_ids = vec2u(octahedral_code_fine(normal_eye * view.eye_from_world), in.object | (material << 16u));
    let w = 1.0 / hit.t;
    return Relief(vec4f(colour, 1.0), normal_ids, w, view.near_m * w);
}

@fragment
fn draw(in: Box) -> Relief {
    let hit = front_hit(eye_ray(in));
    var out = Relief(vec4f(0.0), vec2u(0u), 0.0, 0.0);
    if hit.side == IMPOSTOR_FRONT {
        out = surface_met(in, hit);
    }
    if out.depth <= 0.0 {
        discard;
    }
    return out;
}
