// Draws the quads of one patch into one frustum of a graph camera, as points: the twin of `surface::points::PatchUniform` and
// `surface::points::FrustumUniform`. Anchor space: metres, world axes, relative to the output eye.

struct PatchView {
    // Rows of the affine map from the patch's eye to (u q, v q, q) of the frustum.
    image_from_patch: array<vec4f, 3>,
    // Of the patch's image.
    centre_px: vec2f,
    focal_px: f32,
    // First slot of the patch's moving objects in `movers`.
    first_mover: u32,
}

// The twin of `surface::points::FRUSTUM_PLANES`.
const FRUSTUM_PLANES: u32 = 8u;

struct PointFrustum {
    // Takes (u, v, 1) q to anchor space, less the centre.
    offset_from_image: mat3x3f,
    // Of projection, in anchor space.
    centre_anchor: vec3f,
    // Depth on the near plane: q there.
    near_q: f32,
    size_px: vec2f,
    padding_0: f32,
    padding_1: f32,
    // A point is inside where dot(plane, (u q, v q, q, 1)) is not negative; planes without use are (0, 0, 0, 1).
    planes: array<vec4f, FRUSTUM_PLANES>,
}

@group(0) @binding(0) var<uniform> view: PatchView;
@group(0) @binding(1) var movers: texture_2d<f32>;
@group(0) @binding(2) var<uniform> frustum: PointFrustum;

// As in `surface/quads.wgsl`.
const MOVER_TEXELS: u32 = 6u;
const MOVERS_A_ROW: u32 = 64u;

struct Corner {
    @builtin(position) clip: vec4f,
    // (u q, v q, q) of the frustum and 1, all times w of the patch.
    @location(0) image: vec4f,
    // Depths inside of the planes, times w of the patch.
    @location(1) inside_0: vec4f,
    @location(2) inside_1: vec4f,
}

@vertex
fn vertex(@location(0) image: vec3f, @location(1) corner_normal_mover: u32) -> Corner {
    var rows = view.image_from_patch;
    let mover = corner_normal_mover >> 16u;
    if mover != 0u {
        let slot = view.first_mover + mover - 1u;
        let texel = vec2i(i32(MOVER_TEXELS * (slot % MOVERS_A_ROW)), i32(slot / MOVERS_A_ROW));
        rows[0] = textureLoad(movers, texel, 0);
        rows[1] = textureLoad(movers, texel + vec2i(1, 0), 0);
        rows[2] = textureLoad(movers, texel + vec2i(2, 0), 0);
    }
    let point = vec4f((image.xy - view.centre_px) / view.focal_px, 1.0, image.z);
    let p = vec4f(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point), image.z);
    var out: Corner;
    let across = 2.0 * p.xy / frustum.size_px - p.z;
    out.clip = vec4f(across.x, -across.y, frustum.near_q * image.z, p.z);
    out.image = p;
    for (var index = 0u; index < 4u; index++) {
        out.inside_0[index] = dot(frustum.planes[index], p);
        out.inside_1[index] = dot(frustum.planes[index + 4u], p);
    }
    return out;
}

// The point, and 1: covered.
@fragment
fn fragment(in: Corner) -> @location(0) vec4f {
    let inside = min(in.inside_0, in.inside_1);
    if min(min(inside.x, inside.y), min(inside.z, inside.w)) < 0.0 {
        discard;
    }
    return vec4f(frustum.centre_anchor + frustum.offset_from_image * (in.image.xyz / in.image.w), 1.0);
}
