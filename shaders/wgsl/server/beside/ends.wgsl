// Where the surfaces of what is sent end within a pixel, from a part of the view that is drawn three times as finely: the twin of
// `server::discretize::ends`.
#import "server/beside/view.wgsl"

// The twin of `server::beside::finer::PartUniform`.
struct Part {
    // Its first pixel in the view, with a margin of one: it may lie outside.
    first_px: vec2i,
    // With the margin.
    size_px: vec2u,
}

@group(1) @binding(0) var<uniform> part: Part;
// By pixel of the part: the nearest depth that its finer image draws.
@group(1) @binding(1) var nearest_drawn: texture_storage_2d<r32float, write>;
// The finer image: one higher than the object's id, and near / z.
@group(1) @binding(2) var finer_object: texture_2d<u32>;
@group(1) @binding(3) var finer_depth: texture_depth_2d;

// The twins of the constants there.
const SUBPIXELS: i32 = 3;
const GAP_FOOTPRINTS: f32 = 1.5;
const BENDS: f32 = 2.5;
const NEARER_FOOTPRINTS: f32 = 4.0;

// Whether something farther, or nothing, is beside a sample that is sent.
fn is_outline(p: vec2i) -> bool {
    if !is_inside(p) || pixels[at(p)].send == 0u {
        return false;
    }
    let own = textureLoad(depth, p, 0);
    for (var side = 0u; side < 4u; side++) {
        let next = p + side_of(side);
        if is_inside(next) && textureLoad(depth, next, 0) < own {
            return true;
        }
    }
    return false;
}

// Right, down, left, up.
fn side_of(side: u32) -> vec2i {
    let step = 1 - 2 * i32(side / 2u);
    return select(vec2i(step, 0), vec2i(0, step), (side & 1u) == 1u);
}

@compute @workgroup_size(8, 8)
fn nearest(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= part.size_px) {
        return;
    }
    let p = part.first_px + vec2i(id.xy);
    var depth_here = 0.0;
    var is_drawn = false;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let beside_p = p + vec2i(x, y);
            if is_inside(beside_p) {
                depth_here = max(depth_here, textureLoad(depth, beside_p, 0));
                is_drawn = is_drawn || is_outline(beside_p);
            }
        }
    }
    let drawn = select(0.0, depth_here * (1.0 + NEARER_FOOTPRINTS / beside.focal_px), is_drawn);
    textureStore(nearest_drawn, vec2i(id.xy), vec4f(drawn, 0.0, 0.0, 0.0));
}

// What is seen at a place of the finer image.
struct Seen {
    object: u32,
    depth: f32,
}

fn seen_at(place: vec2i) -> Seen {
    return Seen(textureLoad(finer_object, place, 0).x, textureLoad(finer_depth, place, 0));
}

// The level of a side, in steps of the finer image from the sample's own place.
fn level(centre: vec2i, own: Seen, side: vec2i) -> u32 {
    let next = seen_at(centre + SUBPIXELS * side);
    if next.depth >= own.depth {
        return 0u;
    }
    if next.object == own.object {
        let before = seen_at(centre - SUBPIXELS * side);
        let fell = select(0.0, max(before.depth - own.depth, 0.0), before.object == own.object);
        if own.depth - next.depth <= GAP_FOOTPRINTS * own.depth / beside.focal_px + BENDS * fell {
            return 0u;
        }
    }
    // Nearer to the sample than to what is behind, of the same object; of nearer ones what is behind them is not known.
    let middle = own.depth + (next.depth - own.depth) * 0.5;
    var covered = 0u;
    for (var along = 1; along < SUBPIXELS; along++) {
        for (var aside = -1; aside <= 1; aside++) {
            let seen_there = seen_at(centre + along * side + aside * side.yx);
            let is_same = seen_there.object == own.object && (next.object != own.object || seen_there.depth > middle);
            covered += select(0u, 1u, seen_there.depth >= own.depth || is_same);
        }
    }
    return 1u + covered;
}

@compute @workgroup_size(8, 8)
fn ends(@builtin(global_invocation_id) id: vec3u) {
    // Without the margin.
    if any(id.xy + 2u >= part.size_px) {
        return;
    }
    let in_part = vec2i(id.xy) + 1;
    let p = part.first_px + in_part;
    if !is_outline(p) {
        return;
    }
    let own = Seen((textureLoad(ids, p, 0).y & 0xffffu) + 1u, textureLoad(depth, p, 0));
    let centre = SUBPIXELS * in_part + SUBPIXELS / 2;
    let shown = seen_at(centre);
    // A sample that lies behind something is not seen here.
    if shown.object != own.object || abs(shown.depth - own.depth) > own.depth / beside.focal_px {
        return;
    }
    var all = 0u;
    for (var side = 0u; side < 4u; side++) {
        all |= level(centre, own, side_of(side)) << (4u * side);
    }
    pixels[at(p)].ends = all;
}
