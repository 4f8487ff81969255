// Ambient occlusion from z-buffers: how much of the sky, weighted by the cosine, a pixel's point sees within reach. After the
// horizons of Bavoil and Sainz, and Rosen and others, *Non-pinhole approximations for interactive rendering*, section 6.3, with
// slices around the normal in place of lines of the image: see `client::occlusion`. All positions are relative to the output
// eye, with the world's axes.
#import "client/fullscreen.wgsl"
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"

// The twins of `client::occlusion::pass`.
const OCCLUSION_FRUSTA: u32 = 16u;
const OCCLUSION_PLANES: u32 = 8u;
const OCCLUSION_TAPS: u32 = 640u;
const SLICES: u32 = 16u;

struct OcclusionFrustum {
    // Takes a point less the centre to (u q, v q, q).
    image_from_offset: mat3x3f,
    centre: vec3f,
    // What a pixel spans at a distance of 1 m.
    footprint: f32,
    // A point is inside where dot(plane, (p, 1)) is not negative.
    planes: array<vec4f, OCCLUSION_PLANES>,
}

struct Occlusion {
    reach_m: f32,
    // How many of `taps` there are.
    tap_count: u32,
    // The first is the output view.
    frustum_count: u32,
    // Every how many of `taps` are looked up in each of the graph's z-buffers.
    graph_stride: u32,
    // The output eye relative to what the graph's frusta and points are relative to.
    eye_anchor: vec3f,
    // Whether `occluder_points` has any.
    has_occluders: u32,
    frusta: array<OcclusionFrustum, OCCLUSION_FRUSTA>,
    // In the upper half of the unit ball, z up.
    taps: array<vec4f, OCCLUSION_TAPS>,
}

@group(0) @binding(0) var<uniform> occlusion: Occlusion;
@group(0) @binding(1) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(2) var normal_ids: texture_2d<u32>;
@group(0) @binding(3) var view_points: texture_2d<f32>;
@group(0) @binding(4) var graph_points: texture_2d<f32>;
// The same frusta's z-buffers of what only occludes.
@group(0) @binding(5) var occluder_points: texture_2d<f32>;

// Sine of the elevation up to which nothing counts: normals of a smooth surface differ from its quads' by so much.
const LEAST_SINE: f32 = 0.1;

// A z-buffer shows a point if it has one so near in its pixel, in footprints: half a diagonal, on a surface that is tilted by
// up to 70 degrees.
const SHOWN_FOOTPRINTS: f32 = 2.0;

// What the slices around the normal have found: the greatest share of a slice's sky that one surface hides.
struct Slices {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
}

struct Tangents {
    origin: vec3f,
    normal: vec3f,
    x: vec3f,
    y: vec3f,
}

// Duff and others, *Building an orthonormal basis, revisited*, 2017: the same for a point in every view.
fn tangents(origin: vec3f, n: vec3f) -> Tangents {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return Tangents(origin, n, vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y));
}

// How much of each slice belongs to an azimuth: all within half a slice of its middle, none a slice away.
fn of_slice(cosines: vec4f) -> vec4f {
    // cos 22.5 and cos 11.25 degrees.
    return smoothstep(vec4f(0.9239), vec4f(0.9808), cosines);
}

fn with_tap(slices: Slices, frame: Tangents, footprint: f32, q: vec3f) -> Slices {
    let way = q - frame.origin;
    let squared = dot(way, way);
    let reach = squared / (occlusion.reach_m * occlusion.reach_m);
    // A footprint is how well the z-buffer knows the surface.
    let above = dot(way, frame.normal) - footprint;
    if above <= 0.0 || reach >= 1.0 {
        return slices;
    }
    let sine_squared = above * above / squared;
    let least = LEAST_SINE * LEAST_SINE;
    let hidden = max(sine_squared - least, 0.0) / (1.0 - least) * (1.0 - reach);
    let across = vec2f(dot(way, frame.x), dot(way, frame.y));
    // Never divides by 0. Within a millionth of straight above the way across is mostly rounding, by 2^-24 of its places: the azimuth shrinks to 0 there, and no slice counts it.
    let azimuth = across * inverseSqrt(max(dot(across, across), 1e-12 * squared));
    // Cosines to the middles of four slices that are a quarter turn apart, turned by 0, 45, 22.5 and 67.5 degrees.
    let quarter = vec4f(azimuth.x, azimuth.y, -azimuth.x, -azimuth.y);
    let next = quarter.yzwx;
    return Slices(
        max(slices.a, hidden * of_slice(quarter)),
        max(slices.b, hidden * of_slice(0.70710678 * (quarter + next))),
        max(slices.c, hidden * of_slice(0.92387953 * quarter + 0.38268343 * next)),
        max(slices.d, hidden * of_slice(0.38268343 * quarter + 0.92387953 * next)),
    );
}

fn with_taps(found: Slices, frame: Tangents, points: texture_2d<f32>, frustum: u32, stride: u32) -> Slices {
    var slices = found;
    let also_occluders = frustum > 0u && occlusion.has_occluders != 0u;
    let size = vec2i(textureDimensions(points));
    let matrix = occlusion.frusta[frustum].image_from_offset;
    let centre = occlusion.frusta[frustum].centre;
    let footprint = occlusion.frusta[frustum].footprint * length(frame.origin - centre);
    for (var index = 0u; index < OCCLUSION_TAPS; index += stride) {
        if index >= occlusion.tap_count {
            break;
        }
        let tap = occlusion.reach_m * occlusion.taps[index].xyz;
        let place = frame.origin + tap.x * frame.x + tap.y * frame.y + tap.z * frame.normal;
        let image = matrix * (place - centre);
        if image.z <= 0.0 {
            continue;
        }
        let texel = vec2i(floor(image.xy / image.z));
        if any(texel < vec2i(0)) || any(texel >= size) {
            continue;
        }
        let point = textureLoad(points, texel, 0);
        if point.w > 0.0 {
            slices = with_tap(slices, frame, footprint, point.xyz);
        }
        if also_occluders {
            let occluder = textureLoad(occluder_points, texel, 0);
            if occluder.w > 0.0 {
                slices = with_tap(slices, frame, footprint, occluder.xyz);
            }
        }
    }
    return slices;
}

fn frustum_holds(frustum: u32, p_anchor: vec3f) -> bool {
    var inside = true;
    for (var plane = 0u; plane < OCCLUSION_PLANES; plane++) {
        inside = inside && dot(occlusion.frusta[frustum].planes[plane], vec4f(p_anchor, 1.0)) >= 0.0;
    }
    return inside;
}

// Whether a z-buffer shows a point.
fn is_shown(p_anchor: vec3f, frustum: u32) -> bool {
    let centre = occlusion.frusta[frustum].centre;
    let image = occlusion.frusta[frustum].image_from_offset * (p_anchor - centre);
    let point = textureLoad(graph_points, vec2i(floor(image.xy / image.z)), 0);
    let footprint = occlusion.frusta[frustum].footprint * length(p_anchor - centre);
    return point.w > 0.0 && distance(point.xyz, p_anchor) < SHOWN_FOOTPRINTS * footprint;
}

// The share of the ambient light that arrives: 1 in the open.
@fragment
fn occlude(@builtin(position) position: vec4f) -> @location(0) f32 {
    let pixel = vec2i(position.xy);
    let point = textureLoad(view_points, pixel, 0);
    if point.w == 0.0 {
        return 1.0;
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    var normal = octahedral_normal_fine(ids.x);
    let is_double_sided = (material_table[(ids.y >> 16u) & 0xffu].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    if is_double_sided && dot(normal, point.xyz) > 0.0 {
        normal = -normal;
    }
    var frame = tangents(point.xyz, normal);
    var slices = Slices(vec4f(0.0), vec4f(0.0), vec4f(0.0), vec4f(0.0));
    var shown = false;
    var held = false;
    frame.origin = point.xyz + occlusion.eye_anchor;
    for (var frustum = 1u; frustum < OCCLUSION_FRUSTA; frustum++) {
        if frustum >= occlusion.frustum_count {
            break;
        }
        if frustum_holds(frustum, frame.origin) {
            slices = with_taps(slices, frame, graph_points, frustum, occlusion.graph_stride);
            held = true;
            shown = shown || is_shown(frame.origin, frustum);
        }
    }
    // What only occludes is known wherever graph cameras look; what the view sees adds nothing that would stay.
    if !(shown || held && occlusion.has_occluders != 0u) {
        frame.origin = point.xyz;
        slices = with_taps(slices, frame, view_points, 0u, 1u);
    }
    return 1.0 - dot(slices.a + slices.b + slices.c + slices.d, vec4f(1.0 / f32(SLICES)));
}
