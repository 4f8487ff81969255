// What the rays of a picture need to walk in one impostor, whatever its camera: into the space it was captured in, and back
// with what was met. The entry points beside this file say which walk.
#import "client/fullscreen.wgsl"
#import "client/impostors/filter.wgsl"
#import "client/reflect/found.wgsl"
#import "client/reflect/ray.wgsl"
#import "client/reflect/tile.wgsl"
#import "impostor/ray.wgsl"

const PLACED_OBJECT = 0u;
const PLACED_ENVIRONMENT = 1u;
const PLACED_INSIDE = 2u;

struct Placed {
    // From the world's axes now to those at capture, and the output eye now as seen from the anchor at capture.
    capture_from_now: mat3x3f,
    eye_anchor: vec3f,
    kind: u32,
    // One more than the object; 0 for none.
    object: u32,
    // The sine of the grazing angle from which on a sample counts fully; 0: all do.
    full_facing: f32,
    // 1: colours are averages over what an output pixel spans.
    filtered: u32,
    // How far from the anchor an environment map takes everything to be, metres.
    middle_m: f32,
    // Of the impostors of a round, from 1 on.
    number: u32,
}

@group(0) @binding(0) var<uniform> placed: Placed;
@group(0) @binding(1) var<uniform> image: Impostor;
@group(0) @binding(2) var first: texture_2d<u32>;
@group(0) @binding(3) var second: texture_2d<u32>;
@group(0) @binding(4) var planes: texture_2d<f32>;
@group(0) @binding(5) var ranges: texture_2d<f32>;
@group(0) @binding(6) var shapes: texture_2d<u32>;
@group(0) @binding(7) var colours: texture_2d<f32>;
// 8 is the camera.
@group(0) @binding(9) var tiles: texture_2d<u32>;

// A ray may meet its own start so often before it counts as lost.
const WALK_LEGS = 4;
// What lies nearer to the start than so many footprints of the samples is not told from the surface that the ray leaves: one for
// where the sample may be, one for where the start may be.
const START_FOOTPRINTS = 2.0;

struct Walked {
    @location(0) found: vec4u,
    // Nearer is larger; an f32 tells t + 1 m by a part in 2^24 then.
    @builtin(frag_depth) depth: f32,
}

fn tile_place(index: u32) -> vec2i {
    let columns = textureDimensions(tiles).x;
    return vec2i(vec2u(index % columns, index / columns));
}

// In clip space, the corner of a tile that is drawn, or of nothing.
fn tile_clip(place: vec2i, corner: u32, is_drawn: bool) -> vec4f {
    let size_px = select(0, TILE_PX, is_drawn);
    let corner_px = tile_corner_px(place) + vec2i(vec2u(corner & 1u, corner >> 1u)) * size_px;
    let clip = vec2f(corner_px) / vec2f(textureDimensions(first)) * 2.0 - 1.0;
    return vec4f(clip.x, -clip.y, 0.0, 1.0);
}

// Tiles with rays that are walked in all impostors.
@vertex
fn rayed_tiles(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> @builtin(position) vec4f {
    let place = tile_place(index);
    let tile = tile_from_texel(textureLoad(tiles, place, 0));
    let wanted = select(TILE_OUTSIDE, TILE_INSIDE, placed.kind == PLACED_INSIDE);
    return tile_clip(place, corner, (tile.in_all & wanted) != 0u);
}

struct Guided {
    @builtin(position) position: vec4f,
    // From where to where rays are walked: their parameter, metres.
    @location(0) @interpolate(flat) range_m: vec2f,
}

// Tiles with rays that are walked in this impostor alone.
@vertex
fn guided_tiles(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Guided {
    let place = tile_place(index);
    let tile = tile_from_texel(textureLoad(tiles, place, 0));
    return Guided(tile_clip(place, corner, tile.in_one == placed.number), vec2f(tile.from_m, tile.to_m));
}

fn walked_ray(pixel: vec2i) -> PixelRay {
    return ray_from_texels(textureLoad(first, pixel, 0), textureLoad(second, pixel, 0));
}

// Rays in glass look for its far side alone, others at all but the object that they leave.
fn looks_here(ray: PixelRay) -> bool {
    if placed.kind == PLACED_INSIDE {
        return ray.state == RAY_INSIDE && ray.object == placed.object;
    }
    return ray.state == RAY_OUTSIDE && (placed.kind == PLACED_ENVIRONMENT || ray.object != placed.object);
}

fn captured_ray(ray: PixelRay) -> ImpostorRay {
    let origin = placed.capture_from_now * ray.origin + placed.eye_anchor;
    return ImpostorRay(origin, 0.0, placed.capture_from_now * ray.direction, 3e38);
}

// The ray where the rays around say that it meets something.
fn guided_ray(ray: PixelRay, range_m: vec2f) -> ImpostorRay {
    let captured = captured_ray(ray);
    return ImpostorRay(captured.origin_anchor, range_m.x, captured.direction, range_m.y);
}

// The pixel whose ray is of the low resolution.
fn guide_pixel(place: vec2i) -> vec2i {
    return min(place * GUIDE_PX + GUIDE_AT_PX, vec2i(textureDimensions(first)) - 1);
}

fn footprint_m(hit: ImpostorHit) -> f32 {
    return footprint_of(textureLoad(shapes, hit.pixel, 0).xy);
}

// Whether a crossing is one that the ray was to find: out through the far side of glass, or not its own start.
fn is_met(hit: ImpostorHit) -> bool {
    if placed.kind == PLACED_INSIDE {
        return hit.side == IMPOSTOR_FRONT;
    }
    return hit.side != IMPOSTOR_MISS && hit.t >= START_FOOTPRINTS * footprint_m(hit);
}

// What is left of the ray behind a crossing that does not count.
fn leg_behind(leg: ImpostorRay, hit: ImpostorHit) -> ImpostorRay {
    var rest = leg;
    let footprint = footprint_m(hit);
    rest.t_from = select(START_FOOTPRINTS * footprint, hit.t + footprint, placed.kind == PLACED_INSIDE);
    return rest;
}

// How far apart this ray and that of a neighbouring pixel are at t: differentials by which any mirror, flat or curved, and
// glass say how much of the impostor a pixel shows; negative where the neighbour's ray has another history.
fn spread_m(ray: PixelRay, t: f32, pixel: vec2i) -> f32 {
    let beside = walked_ray(pixel);
    if beside.state != ray.state || beside.object != ray.object || beside.bounces != ray.bounces {
        return -1.0;
    }
    return distance(ray.origin + ray.direction * t, beside.origin + beside.direction * t);
}

// How wide what one of the sixteen rays of a lobe stands for is at t: half of the facets lean by less than the lobe's angle, rays by twice that to either
// side, and a sixteenth of the disk is a quarter as wide.
fn lobe_share_m(ray: PixelRay, t: f32) -> f32 {
    return ray.lobe * t;
}

// How wide the piece of the impostor is that the output pixel shows, in metres; 0 where the neighbours do not say.
fn shown_m(ray: PixelRay, t: f32, pixel: vec2i) -> f32 {
    if ray.lobe > 0.0 {
        return lobe_share_m(ray, t);
    }
    let last = vec2i(textureDimensions(first)) - 1;
    // To the left and above at the right and lower border.
    let step = vec2i(select(1, -1, pixel.x >= last.x), select(1, -1, pixel.y >= last.y));
    let across = spread_m(ray, t, max(pixel + vec2i(step.x, 0), vec2i(0)));
    let down = spread_m(ray, t, max(pixel + vec2i(0, step.y), vec2i(0)));
    if min(across, down) < 0.0 {
        return max(max(across, down), 0.0);
    }
    // A curved mirror stretches what it shows: by the wider side alone it would be blurred along the other one too.
    return sqrt(across * down);
}

fn walked(pixel: vec2i, ray: PixelRay, hit: ImpostorHit) -> Walked {
    var shown_px = 1.0;
    if placed.filtered != 0u {
        shown_px = shown_m(ray, hit.t, pixel) / footprint_m(hit);
    }
    let look = filtered_look(planes, shapes, colours, hit, shown_px);
    var weight = 1.0;
    if placed.full_facing > 0.0 {
        weight = min(look.facing / placed.full_facing, 1.0);
    }
    // Normals go back by the transpose, which is the inverse of the inverse's.
    let normal = normalize(look.normal * placed.capture_from_now);
    let material = u32(textureLoad(colours, hit.pixel, 0).a * 255.0 + 0.5);
    let object = select(0u, placed.object, placed.kind != PLACED_ENVIRONMENT);
    let found = Found(hit.t, normal, look.colour, material, object, weight);
    return Walked(found_texel(found), 1.0 / (1.0 + hit.t));
}

// What `guided.wgsl` reads of a ray of the low resolution.
fn guided_by(hit: ImpostorHit) -> Walked {
    let texel = vec4u(bitcast<u32>(hit.t), placed.number, bitcast<u32>(footprint_m(hit)), 0u);
    return Walked(texel, 1.0 / (1.0 + hit.t));
}
