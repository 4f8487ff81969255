// The quads of one patch as parallelograms in the image of a frame: see `surface::parallelograms`. The twin of `surface::mesh::Vertex`.
#import "surface/parallelogram.wgsl"

struct Patch {
    // Rows of the affine map from the patch's eye to the frame's.
    frame_from_patch: array<vec4f, 3>,
    // Of the patch's image.
    centre_px: vec2f,
    focal_px: f32,
    // First slot of the patch's moving objects in `movers`.
    first_mover: u32,
    frame_focal_px: f32,
    // See `View` in `surface/quads.wgsl`.
    setback: f32,
    // Of the patch, and the place of the first of them in the list.
    first_quad: u32,
    quad_count: u32,
    first: u32,
    // Invocations in a row of the dispatch.
    row: u32,
    padding_0: u32,
    padding_1: u32,
}

const VERTEX_WORDS: u32 = 9u;
const QUAD_INDICES: u32 = 6u;
// The twin of `surface::placement::MOVERS_A_ROW`.
const MOVERS_A_ROW: u32 = 64u;

@group(0) @binding(0) var<uniform> patch_view: Patch;
@group(0) @binding(1) var<storage, read> vertices: array<u32>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;
@group(0) @binding(3) var<storage, read_write> list: array<Parallelogram>;
@group(0) @binding(4) var movers: texture_2d<f32>;

struct Corner {
    // (u, v, w) in the frame's image, from its centre; w 0 where it is behind the frame's eye.
    image: vec3f,
    // Set back by half of its footprint.
    cast_w: f32,
}

fn corner_at(index: u32) -> Corner {
    let first = index * VERTEX_WORDS;
    let image = vec3f(bitcast<f32>(vertices[first]), bitcast<f32>(vertices[first + 1u]), bitcast<f32>(vertices[first + 2u]));
    let mover = vertices[first + 6u] >> 16u;
    var rows = patch_view.frame_from_patch;
    if mover != 0u {
        let slot = patch_view.first_mover + mover - 1u;
        let texel = vec2i(i32(6u * (slot % MOVERS_A_ROW)), i32(slot / MOVERS_A_ROW));
        rows[0] = textureLoad(movers, texel, 0);
        rows[1] = textureLoad(movers, texel + vec2i(1, 0), 0);
        rows[2] = textureLoad(movers, texel + vec2i(2, 0), 0);
    }
    let point = vec4f((image.xy - patch_view.centre_px) / patch_view.focal_px, 1.0, image.z);
    let eye = vec3f(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
    if eye.z <= 0.0 {
        return Corner(vec3f(0.0), 0.0);
    }
    let cast_w = image.z / (eye.z * (1.0 + patch_view.setback / eye.z));
    return Corner(vec3f(patch_view.frame_focal_px * eye.xy, image.z) / eye.z, cast_w);
}

@compute @workgroup_size(64)
fn flatten(@builtin(global_invocation_id) id: vec3u) {
    let quad = id.y * patch_view.row + id.x;
    if quad >= patch_view.quad_count {
        return;
    }
    let first = (patch_view.first_quad + quad) * QUAD_INDICES;
    // Opposite corners are the second of both triangles, whichever vertex comes first: see `surface::mesh`.
    var corners: array<Corner, 4>;
    corners[0] = corner_at(indices[first]);
    corners[1] = corner_at(indices[first + 1u]);
    corners[2] = corner_at(indices[first + 2u]);
    corners[3] = corner_at(indices[first + 4u]);
    let nothing = Parallelogram(vec4f(0.0), vec4f(0.0), vec4f(0.0));
    list[patch_view.first + quad] = nothing;
    if indices[first] == indices[first + 1u] || min(min(corners[0].image.z, corners[1].image.z), min(corners[2].image.z, corners[3].image.z)) <= 0.0 {
        return;
    }
    // Of First: 0 top left, 1 bottom right, 2 top right, 3 bottom left. Of Last: 0 bottom right, 1 top right, 2 top left, 3 bottom left.
    // Only WebGPU's order comes here.
    let centre = (corners[0].image + corners[1].image + corners[2].image + corners[3].image) / 4.0;
    let cast_w = (corners[0].cast_w + corners[1].cast_w + corners[2].cast_w + corners[3].cast_w) / 4.0;
    // Half of the mean sides.
    let right = (corners[2].image + corners[1].image - corners[0].image - corners[3].image) / 4.0;
    let down = (corners[3].image + corners[1].image - corners[0].image - corners[2].image) / 4.0;
    list[patch_view.first + quad] = Parallelogram(vec4f(centre, cast_w - centre.z), vec4f(right, 0.0), vec4f(down, 0.0));
}
