// Draws the quads of one patch into the G-buffer: the twin of `surface::mesh::Vertex` and `surface::pass::ViewUniform`.
//
// A vertex is (u, v, w) of the patch's image. Its point in the patch's eye space is (ray, 1)/w, kept homogeneous: scaled by w
// there is no division, and everything that is interpolated comes out linear in the *patch's* image, which is where corner
// colours are meant to be linear.
#import "common/octahedral.wgsl"

struct View {
    // Rows of the affine map from the patch's eye to the output eye.
    eye_from_patch: array<vec4f, 3>,
    // Of the patch's image.
    centre_px: vec2f,
    focal_px: f32,
    // First slot of the patch's moving objects in `movers`.
    first_mover: u32,
    // Of the output: clip.xy = scale * eye.xy + shift * eye.z.
    clip_scale: vec2f,
    clip_shift: vec2f,
    near_m: f32,
    // See SMOOTHING_*; for `tinted`, what `surface::Tint` says of the patch from bit 8 on.
    smoothing: u32,
    // Its id.
    patch_id: u32,
    // How far a sample is set back, as a share of its distance from where it was captured: see `surface::pass::SETBACK_FOOTPRINTS`.
    setback: f32,
}

// The twin of `protocol::DepthImage::WHOLE`.
const WHOLE: f32 = 64.0;

const SMOOTHING_NONE: u32 = 0u;
const SMOOTHING_BLENDED: u32 = 1u;
const SMOOTHING_LINEAR: u32 = 2u;
// Sine of the angle between two steps on the screen, in the patch's image, below which f32 cannot tell them from parallel. Coordinates of up to 2048
// pixels round by 6e-5, steps between them by 1.2e-4, and where both are a pixel long their sine by 2.4e-4: a quarter of this.
const EDGE_ON: f32 = 1e-3;

@group(0) @binding(0) var<uniform> view: View;
// A slot of six texels a moving object, MOVERS_A_ROW slots a row: three rows of `eye_from_patch` for it, then three of the world's turn since capture, for normals.
@group(0) @binding(1) var movers: texture_2d<f32>;

// The twin of `surface::placement::MOVERS_A_ROW`.
const MOVERS_A_ROW: u32 = 64u;

struct VertexIn {
    @location(0) image: vec3f,
    @location(1) colour_material: u32,
    @location(2) normal_object: u32,
    @location(3) corner_colour_trim: u32,
    @location(4) corner_normal_mover: u32,
    @location(5) pixel: u32,
    @location(6) normal_rests_level_end: u32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    // (u, v, w) in the patch's image.
    @location(0) image: vec3f,
    // sRGB-encoded, and 1 where the surface says that it ends.
    @location(1) colour_end: vec4f,
    @location(2) normal: vec3f,
    @location(3) @interpolate(flat, either) quad_colour_material: u32,
    @location(4) @interpolate(flat, either) quad_pixel: u32,
    // Three numbers for the normal, which a moving object turns, and the object with the quad's level from bit 16 and what it hides from bit 25 on.
    @location(5) @interpolate(flat, either) quad_normal: vec3f,
    @location(6) @interpolate(flat, either) quad_object_level: u32,
}

struct Surface {
    // sRGB bytes; alpha is how much it hides, 1 where it is not seen through.
    @location(0) colour: vec4f,
    // x: octahedral normal, 16 + 16 bits; y: object, material << 16, bit 31 where the surface says that it ends close by, and bit 30 of triangles as they are.
    @location(1) normal_ids: vec2u,
    // 1/z in the output's eye space, 1/m.
    @location(2) w: f32,
}

// The depth that is tested: of overlapping samples of a surface the finer one is to show. `depth / z` is the depth of a corner; at
// the near plane, where it is 1, it stays, so that the same is cut off there.
fn set_back(depth: f32, z: f32) -> f32 {
    if z <= 0.0 {
        return depth;
    }
    return depth * (1.0 - min(view.setback / z, 0.5) * (1.0 - depth / z));
}

// Where a moving object's texels begin; 0 is none.
fn mover_texel(mover: u32) -> vec2i {
    let slot = view.first_mover + mover - 1u;
    return vec2i(i32(6u * (slot % MOVERS_A_ROW)), i32(slot / MOVERS_A_ROW));
}

fn rows_of(mover: u32) -> array<vec4f, 3> {
    let texel = mover_texel(mover);
    return array(
        textureLoad(movers, texel, 0),
        textureLoad(movers, texel + vec2i(1, 0), 0),
        textureLoad(movers, texel + vec2i(2, 0), 0),
    );
}

// In the output's eye space, times the patch's `w`.
fn eye_from_image(rows: array<vec4f, 3>, image: vec3f) -> vec3f {
    let point = vec4f((image.xy - view.centre_px) / view.focal_px, 1.0, image.z);
    return vec3f(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
}

@vertex
fn vertex(in: VertexIn) -> Corner {
    var rows = view.eye_from_patch;
    let normal = octahedral_normal_with_rest(in.corner_normal_mover & 0xffffu, (in.normal_rests_level_end >> 8u) & 0xffu);
    let quad_normal = octahedral_normal_with_rest(in.normal_object & 0xffffu, in.normal_rests_level_end & 0xffu);
    var out: Corner;
    out.normal = normal;
    out.quad_normal = quad_normal;
    let mover = in.corner_normal_mover >> 16u;
    if mover != 0u {
        let texel = mover_texel(mover);
        let turn = mat3x3f(
            textureLoad(movers, texel + vec2i(3, 0), 0).xyz,
            textureLoad(movers, texel + vec2i(4, 0), 0).xyz,
            textureLoad(movers, texel + vec2i(5, 0), 0).xyz,
        );
        rows = rows_of(mover);
        // `turn` holds rows.
        out.normal = normal * turn;
        out.quad_normal = quad_normal * turn;
    }
    let eye = eye_from_image(rows, in.image);
    let depth = set_back(view.near_m * in.image.z, eye.z);
    out.clip = vec4f(view.clip_scale * eye.xy + view.clip_shift * eye.z, depth, eye.z);
    out.image = in.image;
    out.colour_end = vec4f(unpack4x8unorm(in.corner_colour_trim).xyz, f32((in.normal_rests_level_end >> 24u) & 1u));
    out.quad_colour_material = in.colour_material;
    out.quad_pixel = in.pixel;
    out.quad_object_level = (in.normal_object >> 16u) | (in.normal_rests_level_end & 0x7eff0000u);
    return out;
}

// How many pixels wide and high a quad is.
fn quad_px(in: Corner) -> f32 {
    return f32(1u << ((in.quad_object_level >> 16u) & 0xffu));
}

fn centre_px(in: Corner) -> vec2f {
    return vec2f(f32(in.quad_pixel & 0xffffu), f32(in.quad_pixel >> 16u)) + 0.5 * quad_px(in);
}

// 1 at the centre of the quad, 0 on its border.
fn tent(in: Corner) -> f32 {
    let sides = clamp(1.0 - abs(2.0 * (in.image.xy - centre_px(in)) / quad_px(in)), vec2f(0.0), vec2f(1.0));
    return sides.x * sides.y;
}

// The way to the quad's centre in steps to the right and down on the screen; none where the quad is seen edge-on. Over a
// triangle everything is linear in the patch's image, so these steps lead exactly there.
fn steps_to_centre(in: Corner) -> vec2f {
    let right = dpdx(in.image.xy);
    let down = dpdy(in.image.xy);
    let determinant = right.x * down.y - right.y * down.x;
    let way = centre_px(in) - in.image.xy;
    let steps = vec2f(way.x * down.y - way.y * down.x, right.x * way.y - right.y * way.x) / determinant;
    return select(vec2f(0.0), steps, abs(determinant) > EDGE_ON * length(right) * length(down));
}

// Inverse depth in the output's eye space, 1/m: not that of the depth test, which is set back.
fn w_of(in: Corner) -> f32 {
    return in.image.z * in.clip.w;
}

struct Look {
    // sRGB-encoded; may lie outside of [0, 1], which the target clamps.
    colour: vec3f,
    normal: vec3f,
}

fn look(in: Corner) -> Look {
    let steps = steps_to_centre(in);
    let colour = in.colour_end.rgb;
    let colour_at_centre = colour + steps.x * dpdx(colour) + steps.y * dpdy(colour);
    let normal_at_centre = in.normal + steps.x * dpdx(in.normal) + steps.y * dpdy(in.normal);
    let quad_colour = unpack4x8unorm(in.quad_colour_material).xyz;
    if view.smoothing == SMOOTHING_NONE {
        return Look(quad_colour, in.quad_normal);
    }
    if view.smoothing == SMOOTHING_LINEAR {
        return Look(colour, in.normal);
    }
    // How much of what the sample differs from its corners shows: all at the centre, half on the border.
    let share = mix(0.5, 1.0, sqrt(tent(in)));
    return Look(
        colour + share * (quad_colour - colour_at_centre),
        in.normal + share * (in.quad_normal - normal_at_centre),
    );
}

@fragment
fn fragment(in: Corner) -> Surface {
    let shown = look(in);
    let material = in.quad_colour_material >> 24u;
    var out: Surface;
    let share = in.quad_object_level >> 25u;
    out.colour = vec4f(shown.colour, select(f32(share) / WHOLE, 1.0, share == 0u));
    let end = select(0u, 1u << 31u, in.colour_end.a > 0.0);
    out.normal_ids = vec2u(octahedral_code_fine(shown.normal), (in.quad_object_level & 0xffffu) | (material << 16u) | end);
    out.w = w_of(in);
    return out;
}

// From the newest or finest to the oldest or coarsest: yellow, red, violet, dark blue.
fn tint(level: f32) -> vec3f {
    let newer = mix(vec3f(1.0, 0.9, 0.35), vec3f(0.9, 0.3, 0.2), clamp(3.0 * level, 0.0, 1.0));
    let older = mix(newer, vec3f(0.5, 0.15, 0.55), clamp(3.0 * level - 1.0, 0.0, 1.0));
    return mix(older, vec3f(0.08, 0.08, 0.35), clamp(3.0 * level - 2.0, 0.0, 1.0));
}

// What a sample is, in place of what it saw: how old, or how many of them there are to a pixel along a side, from eight to an eighth.
@fragment
fn tinted(in: Corner) -> Surface {
    let samples_a_pixel = max(length(dpdx(in.image.xy)), length(dpdy(in.image.xy))) / quad_px(in);
    let coarse = clamp(0.5 - log2(max(samples_a_pixel, 1e-3)) / 6.0, 0.0, 1.0);
    let old = f32(view.smoothing >> 16u) / 65535.0;
    let level = select(old, coarse, ((view.smoothing >> 8u) & 1u) == 1u);
    let material = in.quad_colour_material >> 24u;
    let end = select(0u, 1u << 31u, in.colour_end.a > 0.0);
    let ids = vec2u(octahedral_code_fine(in.quad_normal), (in.quad_object_level & 0xffffu) | (material << 16u) | end);
    return Surface(vec4f(tint(level), 1.0), ids, w_of(in));
}

// What casts shadows: its distance, with half of its footprint added. The footprint is a share of the distance from where it was captured,
// 1/patch_w; `nearer` is how many times as far that is as its depth now.
fn cast_w(patch_w: f32, nearer: f32) -> f32 {
    return patch_w * nearer / (1.0 + view.setback * nearer);
}

// The same, and what its surface rises over half a sample to either side, at most a footprint more: where a surface bends, its quads lie so far off
// it, and maps may have far finer texels than samples.
@fragment
fn casting(in: Corner) -> Surface {
    let w = cast_w(in.image.z, in.clip.w);
    let samples_a_texel = max(length(dpdx(in.image.xy)), length(dpdy(in.image.xy)));
    let rise = 0.5 * (abs(dpdx(w)) + abs(dpdy(w))) / samples_a_texel;
    let farthest = in.image.z * in.clip.w / (1.0 + 3.0 * view.setback * in.clip.w);
    return Surface(vec4f(0.0), vec2u(0u), max(w - rise, farthest));
}

struct CastCorner {
    @builtin(position) clip: vec4f,
    // In the patch's image.
    @location(0) w: f32,
}

// The same where nothing but `w` is drawn.
@vertex
fn cast_vertex(in: VertexIn) -> CastCorner {
    var rows = view.eye_from_patch;
    let mover = in.corner_normal_mover >> 16u;
    if mover != 0u {
        rows = rows_of(mover);
    }
    let eye = eye_from_image(rows, in.image);
    let depth = set_back(view.near_m * in.image.z, eye.z);
    return CastCorner(vec4f(view.clip_scale * eye.xy + view.clip_shift * eye.z, depth, eye.z), in.image.z);
}

@fragment
fn casting_w(in: CastCorner) -> @location(0) f32 {
    return cast_w(in.w, in.clip.w);
}

// The same with its change a pixel to the right and down; on a plane that is the same all over it.
@fragment
fn casting_plane(in: CastCorner) -> @location(0) vec4f {
    let w = cast_w(in.w, in.clip.w);
    return vec4f(w, dpdx(w), dpdy(w), 0.0);
}

// Which sample is seen: the twin of `surface::AddressTexel`.
@fragment
fn address(in: Corner) -> @location(0) vec4u {
    // Without slopes: a comparison of surfaces wants the steadier normal.
    let normal = octahedral_code(mix(in.normal, in.quad_normal, tent(in)));
    let w = w_of(in);
    return vec4u(view.patch_id, in.quad_pixel, normal | (in.quad_object_level << 16u), bitcast<u32>(w));
}
