// The scene's triangles, from their buffers to what a fragment knows of its surface. Shared by every pass that rasterizes
// the scene; the files `raster_native.wgsl` and `raster_pulled.wgsl` hold the entry points.
#import "server/view.wgsl"

struct Instance {
    // Rows of the affine map from the mesh's space to metres relative to the anchor, world axes.
    anchor_from_mesh_x: vec4f,
    anchor_from_mesh_y: vec4f,
    anchor_from_mesh_z: vec4f,
    // Rows of the inverse transpose of its linear part, for normals.
    world_normal_from_mesh_x: vec4f,
    world_normal_from_mesh_y: vec4f,
    world_normal_from_mesh_z: vec4f,
    // Id of its first triangle; ids start at 1, so that 0 can mean that there is none.
    triangle_base: u32,
    object: u32,
    // Index into `materials`.
    material: u32,
    // See MIRRORED and HIDES.
    flags: u32,
    // Where its mesh begins in the buffers.
    first_vertex: u32,
    first_index: u32,
    // What base colours are multiplied by: linear RGB, 8 bits each.
    tint: u32,
    // Which of its faces are in the layer that is drawn; 0 of what is in none.
    faces: u32,
}

// Normals: of a mirror or glass, and of everything in a view at rest.
const FINE_NORMAL: u32 = 1u;
// Colours: of everything in a view at rest.
const FINE_COLOUR: u32 = 2u;

// Of `flags`: its map turns left to right, and with it the winding of triangles.
const MIRRORED: u32 = 1u;
// Nothing of it is a sample, but it hides what lies behind it: its triangles have no id.
const HIDES: u32 = 2u;

// Of `faces`.
const FRONT: u32 = 1u;
const BACK: u32 = 2u;
// The twin of `protocol::DepthImage::WHOLE`.
const WHOLE: f32 = 64.0;

const WRAP_REPEAT: u32 = 0u;
const WRAP_MIRROR: u32 = 1u;

struct SurfaceMaterial {
    // Linear RGBA factor.
    base_colour: vec4f,
    alpha_cutoff: f32,
    // Index into the material table of the samples.
    code: u32,
    // 1 where it is drawn from both sides.
    double_sided: u32,
    // What is kept finely of its surfaces, see FINE_*.
    fine: u32,
    // What the tilts of its normal map are multiplied by; 0 without one.
    bump_scale: f32,
    // 0: `code` holds everywhere. Else `codes` tells it, place by place, and this is 1 + how they are wrapped along u + 3 times how along v.
    varies: u32,
    // The same by the second set of texture coordinates and `second_codes`: what both tell is added.
    varies_by_second: u32,
    // 1: where it is seen through, not its alpha but its material says how much.
    is_pane: u32,
    // 1 where its normal map goes by the second set of texture coordinates.
    bumps_by_second: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    // Rows of the affine maps from texture coordinates to those of the normal map and of the codes.
    bumps_from_u: vec4f,
    bumps_from_v: vec4f,
    codes_from_u: vec4f,
    codes_from_v: vec4f,
    second_codes_from_u: vec4f,
    second_codes_from_v: vec4f,
}

@group(1) @binding(0) var<storage, read> instances: array<Instance>;
@group(1) @binding(1) var<storage, read> materials: array<SurfaceMaterial>;
// By vertex; texture coordinates beside those of the vertices, where any material needs some.
@group(1) @binding(2) var<storage, read> second_uvs: array<vec2f>;
// A plane that cuts the scene open: what lies beyond it, relative to the anchor, where dot(xyz, p) > w, is not there. No plane has a normal of 0.
@group(1) @binding(3) var<uniform> section: vec4f;
@group(2) @binding(0) var base_texture: texture_2d<f32>;
@group(2) @binding(1) var base_sampler: sampler;
@group(2) @binding(2) var normal_texture: texture_2d<f32>;
@group(2) @binding(3) var normal_sampler: sampler;
// Indices into the material table of the samples, of a material whose textures say more than its colour.
@group(2) @binding(4) var codes: texture_2d<u32>;
@group(2) @binding(5) var second_codes: texture_2d<u32>;

// Whether fragments below the material's alpha cut-off, and those beyond the section, are dropped.
override cut_out: bool = false;
// Whether the material may have a normal map or vary from place to place: without, nothing is read for it.
override detailed: bool = false;
// Whether the insides of what a section opens are seen: not by passes of faces that turn away.
override opens: bool = true;

struct MeshVertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) colour: vec4f,
}

struct Varying {
    @builtin(position) clip: vec4f,
    // Relative to the eye, world axes.
    @location(0) position: vec3f,
    @location(1) normal_world: vec3f,
    @location(2) uv: vec2f,
    @location(3) colour: vec4f,
    @location(4) @interpolate(flat, either) instance: u32,
    // The triangle within its mesh where the vertex stage has to tell it; the same at all three corners.
    @location(5) @interpolate(flat, either) triangle: u32,
    @location(6) second_uv: vec2f,
}

// `index`: of the vertex among all.
fn corner(vertex: MeshVertex, index: u32, instance_index: u32, triangle: u32) -> Varying {
    let instance = instances[instance_index];
    let p_mesh = vec4f(vertex.position, 1.0);
    let p_anchor = vec3f(
        dot(instance.anchor_from_mesh_x, p_mesh),
        dot(instance.anchor_from_mesh_y, p_mesh),
        dot(instance.anchor_from_mesh_z, p_mesh),
    );
    var out: Varying;
    out.position = p_anchor - camera.eye_anchor;
    out.clip = pinhole_clip_from_eye(camera, pinhole_eye_from_anchor(camera, p_anchor));
    out.normal_world = vec3f(
        dot(instance.world_normal_from_mesh_x.xyz, vertex.normal),
        dot(instance.world_normal_from_mesh_y.xyz, vertex.normal),
        dot(instance.world_normal_from_mesh_z.xyz, vertex.normal),
    );
    out.uv = vertex.uv;
    out.second_uv = second_uvs[min(index, arrayLength(&second_uvs) - 1u)];
    out.colour = vertex.colour;
    out.instance = instance_index;
    out.triangle = triangle;
    return out;
}

// How a fragment's place and texture coordinates change a pixel to the right and down, the same for the four fragments of a quad. Derivatives
// need all fragments.
struct Slopes {
    dx_position: vec3f,
    dy_position: vec3f,
    dx_uv: vec2f,
    dy_uv: vec2f,
    dx_second_uv: vec2f,
    dy_second_uv: vec2f,
}

fn slopes_of(v: Varying) -> Slopes {
    return Slopes(
        dpdxCoarse(v.position),
        dpdyCoarse(v.position),
        dpdxCoarse(v.uv),
        dpdyCoarse(v.uv),
        dpdxCoarse(v.second_uv),
        dpdyCoarse(v.second_uv),
    );
}

// A place in a texture, and how it changes a pixel to the right and down.
struct UvPlace {
    uv: vec2f,
    dx: vec2f,
    dy: vec2f,
}

// By the rows of an affine map from the first or the second set of texture coordinates.
fn uv_place(v: Varying, slopes: Slopes, by_second: bool, from_u: vec4f, from_v: vec4f) -> UvPlace {
    let from_uv = mat2x2f(vec2f(from_u.x, from_v.x), vec2f(from_u.y, from_v.y));
    let offset = vec2f(from_u.z, from_v.z);
    if by_second {
        return UvPlace(from_uv * v.second_uv + offset, from_uv * slopes.dx_second_uv, from_uv * slopes.dy_second_uv);
    }
    return UvPlace(from_uv * v.uv + offset, from_uv * slopes.dx_uv, from_uv * slopes.dy_uv);
}

// A texel's place along a side of a texture, as `scene::model::Wrap` has it.
fn wrapped(place: f32, side: f32, mode: u32) -> i32 {
    var share = place;
    if mode == WRAP_REPEAT {
        share = fract(place);
    } else if mode == WRAP_MIRROR {
        share = 1.0 - abs(1.0 - 2.0 * fract(place * 0.5));
    }
    return i32(clamp(share * side, 0.0, side - 1.0));
}

// The index into the material table of the samples.
fn code_of(v: Varying, slopes: Slopes) -> u32 {
    let material = materials[instances[v.instance].material];
    if !detailed || (material.varies == 0u && material.varies_by_second == 0u) {
        return material.code;
    }
    var code = 0u;
    if material.varies != 0u {
        code += code_at(codes, material.varies, uv_place(v, slopes, false, material.codes_from_u, material.codes_from_v));
    }
    if material.varies_by_second != 0u {
        let place = uv_place(v, slopes, true, material.second_codes_from_u, material.second_codes_from_v);
        code += code_at(second_codes, material.varies_by_second, place);
    }
    return code;
}

// Of the texel that lies there, of the level whose texels are about as large as a pixel. It is the same for a quad, as devices may load from one level
// for all four.
fn code_at(codes: texture_2d<u32>, varies: u32, place: UvPlace) -> u32 {
    let size = textureDimensions(codes);
    let texels = max(length(place.dx * vec2f(size)), length(place.dy * vec2f(size)));
    let level = clamp(i32(round(log2(max(texels, 1.0)))), 0, i32(textureNumLevels(codes)) - 1);
    // Not asked of the texture: llvmpipe answers for one fragment's level to all that it shades together.
    let level_size = vec2f(max(size >> vec2u(u32(level)), vec2u(1u)));
    let wrap = varies - 1u;
    let texel = vec2i(wrapped(place.uv.x, level_size.x, wrap % 3u), wrapped(place.uv.y, level_size.y, wrap / 3u));
    return textureLoad(codes, texel, level).x;
}

// The normal as the material's normal map tilts it. Tangents are where the texture coordinates grow along the triangle, at right angles to the normal
// (after Schueler, *Normal mapping without precomputed tangents*, 2006); green tilts towards the upper edge of the map, where v falls. What is seen from
// behind has the tilted normal turned round as a whole (glTF 2.0, 3.9.6).
fn bumped(v: Varying, slopes: Slopes, normal: vec3f) -> vec3f {
    let material = materials[instances[v.instance].material];
    let scale = material.bump_scale;
    if !detailed {
        return normal;
    }
    let place = uv_place(v, slopes, material.bumps_by_second != 0u, material.bumps_from_u, material.bumps_from_v);
    let turn = place.dx.x * place.dy.y - place.dx.y * place.dy.x;
    if scale == 0.0 || turn == 0.0 {
        return normal;
    }
    let texel = textureSampleGrad(normal_texture, normal_sampler, place.uv, place.dx, place.dy).xyz;
    let tilt = 2.0 * texel - 1.0;
    let along_u = (slopes.dx_position * place.dy.y - slopes.dy_position * place.dx.y) * sign(turn);
    let along_v = (slopes.dy_position * place.dx.x - slopes.dx_position * place.dy.x) * sign(turn);
    let level = along_u - normal * dot(normal, along_u);
    let squared = dot(level, level);
    if squared == 0.0 {
        return normal;
    }
    let tangent = level * inverseSqrt(squared);
    let across = cross(normal, tangent);
    let upwards = across * -sign(dot(across, along_v));
    let side = sign(dot(normal, v.normal_world));
    let tilted = side * scale * (tilt.x * tangent + tilt.y * upwards) + max(tilt.z, 0.0) * normal;
    let length_squared = dot(tilted, tilted);
    // Its parts are no longer than about 1 and round by 2^-24 of that: what is shorter than a millionth, sixteen times as much, has no direction. 1e-30 only serves where the
    // other is chosen.
    return select(normal, tilted * inverseSqrt(max(length_squared, 1e-30)), length_squared > 1e-12);
}

struct Surface {
    // Linear RGB.
    base: vec3f,
    // Unit length; turned towards the eye where the material has two sides.
    normal_world: vec3f,
    // Id over the whole scene, 1 and more; 0 of what only hides.
    triangle: u32,
    object: u32,
    // Index into the material table of the samples.
    material: u32,
    // What of it is kept finely: FINE_NORMAL, FINE_COLOUR.
    fine: u32,
    // Whether the material's cut-off or the section drops it, or it is of another layer.
    cut: bool,
    // Of what is in a layer, how much it hides of `WHOLE`, 1 and more; else 0.
    hides: u32,
}

// The id of a fragment's triangle over the whole scene, 1 and more; 0 of what only hides.
fn scene_triangle(v: Varying, triangle_of_mesh: u32) -> u32 {
    let instance = instances[v.instance];
    return select(instance.triangle_base + triangle_of_mesh, 0u, (instance.flags & HIDES) != 0u);
}

// `texel` is the base colour texture's.
fn surface_at(v: Varying, front_facing: bool, triangle_of_mesh: u32, texel: vec4f) -> Surface {
    let instance = instances[v.instance];
    let material = materials[instance.material];
    let base = texel * material.base_colour * v.colour * unpack4x8unorm(instance.tint);
    let squared = dot(v.normal_world, v.normal_world);
    // 0 where a triangle's normals cancel. The greatest number of the map of normals is 1, so that one of 1e-15, the root of this, is of a mesh made flat 1e15 times.
    var normal = v.normal_world * inverseSqrt(max(squared, 1e-30));
    let is_back = front_facing == ((instance.flags & MIRRORED) != 0u);
    // Where a plane cuts it open, its insides are seen.
    let is_open = opens && any(section.xyz != vec3f(0.0));
    if (material.double_sided != 0u || is_open) && is_back {
        normal = -normal;
    }
    var out: Surface;
    out.base = base.rgb;
    out.normal_world = normal;
    out.triangle = scene_triangle(v, triangle_of_mesh);
    out.object = instance.object;
    out.material = material.code;
    out.fine = material.fine;
    var cutoff = material.alpha_cutoff;
    if instance.faces != 0u {
        let is_pane = material.is_pane != 0u;
        let is_other = (instance.faces & select(FRONT, BACK, is_back)) == 0u;
        cutoff = select(select(0.5 / WHOLE, cutoff, is_pane), 2.0, is_other);
        out.hides = select(u32(round(clamp(base.a * WHOLE, 1.0, WHOLE))), u32(WHOLE), is_pane);
    }
    out.cut = cut_out && (base.a < cutoff || dot(section.xyz, v.position + camera.eye_anchor) > section.w);
    return out;
}
