// Triangles of an object as they are, bent by bones, into the G-buffer. The twin of `bodies::pass`.
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"
#import "common/srgb.wgsl"

struct Body {
    // The box that positions lie in: its least corner, and how large it is.
    least: vec4f,
    size: vec4f,
    // The same of texture coordinates.
    least_size_uv: vec4f,
    material: u32,
    // Whether each triangle is shaded as the plane that it is.
    is_flat: u32,
    // Whether it is placed by maps that turn left to right.
    mirrored: u32,
    // By how much inverse depth is less where it casts, as a share.
    setback: f32,
}

// The twin of `protocol::Body::NORMAL_STEPS`.
const NORMAL_STEPS: f32 = 1022.0;
// Its outlines are where it ends: nothing of it goes on into a gap beside it, but something else may.
const EXACT: u32 = 0x40000000u;
// Rows of `protocol::Body::MOST_BONES`.
const MOST_ROWS: u32 = 768u;

@group(0) @binding(0) var<uniform> view: Pinhole;
@group(0) @binding(1) var<uniform> body: Body;
// Three rows a bone.
@group(0) @binding(2) var<uniform> bones: array<vec4f, MOST_ROWS>;
// Linear light, times how much of it there is, which is the alpha.
@group(0) @binding(3) var colours: texture_2d<f32>;
@group(0) @binding(4) var colours_sampler: sampler;

struct Vertex {
    @location(0) position: vec4f,
    @location(1) normal: vec2f,
    @location(2) uv: vec2f,
    @location(3) colour: vec4f,
    @location(4) bones: vec4u,
    @location(5) shares: vec4f,
    // Of the object. Rows of the affine maps from the body's space to the eye's, and of what normals are turned by to the world's axes.
    @location(6) eye_from_body_x: vec4f,
    @location(7) eye_from_body_y: vec4f,
    @location(8) eye_from_body_z: vec4f,
    @location(9) world_normal_from_body_x: vec4f,
    @location(10) world_normal_from_body_y: vec4f,
    @location(11) world_normal_from_body_z: vec4f,
    // Linear RGB.
    @location(12) tint: vec4f,
    @location(13) object: u32,
}

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) p_eye: vec3f,
    @location(1) normal_world: vec3f,
    @location(2) uv: vec2f,
    @location(3) colour: vec3f,
    @location(4) @interpolate(flat, either) object: u32,
}

// As `Surface` of `surface/quads.wgsl`.
struct Shown {
    @location(0) colour: vec4f,
    @location(1) normal_ids: vec2u,
    @location(2) w: f32,
}

struct Bone {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// A row of the four bones of a vertex, by their shares.
fn row_of(vertex: Vertex, row: u32) -> vec4f {
    let at = 3u * vertex.bones + vec4u(row);
    let first = vertex.shares.x * bones[at.x] + vertex.shares.y * bones[at.y];
    return first + vertex.shares.z * bones[at.z] + vertex.shares.w * bones[at.w];
}

fn bone_of(vertex: Vertex) -> Bone {
    return Bone(row_of(vertex, 0u), row_of(vertex, 1u), row_of(vertex, 2u));
}

fn moved(rows: Bone, p: vec4f) -> vec3f {
    return vec3f(dot(rows.x, p), dot(rows.y, p), dot(rows.z, p));
}

// Normals stay at right angles: by the rows' cofactors, which are the inverse transpose but for a factor, of the sign of what does not mirror.
fn turned(rows: Bone, normal: vec3f) -> vec3f {
    let turned_x = cross(rows.y.xyz, rows.z.xyz);
    let turned_y = cross(rows.z.xyz, rows.x.xyz);
    let turned_z = cross(rows.x.xyz, rows.y.xyz);
    let side = select(-1.0, 1.0, dot(rows.x.xyz, turned_x) >= 0.0);
    return side * vec3f(dot(turned_x, normal), dot(turned_y, normal), dot(turned_z, normal));
}

fn decoded_normal(code: vec2f) -> vec3f {
    var p = code * 65535.0 / (0.5 * NORMAL_STEPS) - 1.0;
    let z = 1.0 - abs(p.x) - abs(p.y);
    if z < 0.0 {
        p = octahedral_fold(p);
    }
    return vec3f(p, z);
}

fn at_rest(vertex: Vertex) -> vec4f {
    return vec4f(body.least.xyz + vertex.position.xyz * body.size.xyz, 1.0);
}

@vertex
fn place(vertex: Vertex) -> Varying {
    return placed(vertex, at_rest(vertex), decoded_normal(vertex.normal));
}

// The same of what bones bend. By itself, not by a branch on a uniform: software Vulkan compiles a shader anew at each draw for what its branches depend on.
@vertex
fn place_bent(vertex: Vertex) -> Varying {
    let rows = bone_of(vertex);
    return placed(vertex, vec4f(moved(rows, at_rest(vertex)), 1.0), turned(rows, decoded_normal(vertex.normal)));
}

fn placed(vertex: Vertex, p: vec4f, normal: vec3f) -> Varying {
    let p_eye = moved(Bone(vertex.eye_from_body_x, vertex.eye_from_body_y, vertex.eye_from_body_z), p);
    var out: Varying;
    out.clip = pinhole_clip_from_eye(view, p_eye);
    out.p_eye = p_eye;
    out.normal_world = normalize(vec3f(
        dot(vertex.world_normal_from_body_x.xyz, normal),
        dot(vertex.world_normal_from_body_y.xyz, normal),
        dot(vertex.world_normal_from_body_z.xyz, normal),
    ));
    out.uv = body.least_size_uv.xy + vertex.uv * body.least_size_uv.zw;
    out.colour = vertex.colour.rgb * vertex.tint.rgb;
    out.object = vertex.object;
    return out;
}

// Of the plane of a fragment's triangle, towards the eye.
fn plane_normal_world(dx_eye: vec3f, dy_eye: vec3f, p_eye: vec3f) -> vec3f {
    let normal_eye = cross(dx_eye, dy_eye);
    return select(-normal_eye, normal_eye, dot(normal_eye, p_eye) < 0.0) * view.eye_from_world;
}

@fragment
fn show(in: Varying, @builtin(front_facing) is_front: bool) -> Shown {
    let texel = textureSample(colours, colours_sampler, in.uv);
    return shown(in, is_front, texel, plane_normal_world(dpdx(in.p_eye), dpdy(in.p_eye), in.p_eye));
}

// The same of what is cut out where the image has no sample. By itself: where nothing is ever discarded, what is hidden is never shaded.
@fragment
fn show_cut(in: Varying, @builtin(front_facing) is_front: bool) -> Shown {
    let texel = textureSample(colours, colours_sampler, in.uv);
    let plane_world = plane_normal_world(dpdx(in.p_eye), dpdy(in.p_eye), in.p_eye);
    if texel.a < 0.5 {
        discard;
    }
    return shown(in, is_front, texel, plane_world);
}

fn shown(in: Varying, is_front: bool, texel: vec4f, plane_world: vec3f) -> Shown {
    // Colours come times alpha, in 8 bits: less than a step of it, which only filtering leaves, tells no colour.
    let base = texel.rgb / max(texel.a, 1.0 / 255.0) * in.colour;
    let vertex_world = select(-in.normal_world, in.normal_world, is_front == (body.mirrored == 0u));
    let normal_world = select(vertex_world, plane_world, body.is_flat != 0u);
    let ids = in.object | (body.material << 16u) | EXACT;
    return Shown(vec4f(srgb_from_linear(base), 1.0), vec2u(octahedral_code_fine(normal_world), ids), (1.0 - body.setback) / in.p_eye.z);
}
