// Which casters are within reach of what is seen: the passes of `client::soft::reach`.
#import "camera/pinhole.wgsl"
#import "surface/parallelogram.wgsl"
#import "client/compute/warp_frame.wgsl"

const REACH_LEVELS: u32 = 16u;

struct Reach {
    // Shifts of the lamp's points, pixels of the frame's image at w = 1: the least of each axis, and the greatest.
    least_shift: vec2f,
    greatest_shift: vec2f,
    // Of the frame.
    centre_px: vec2f,
    // Invocations in a row of the dispatch.
    row: u32,
    padding: u32,
    // Of tiles: width, height, and the place of the first tile. Every level has half of the sides of the one before it, the last is one tile.
    levels: array<vec4u, REACH_LEVELS>,
}

// Pixels of a side.
const TILE_PX: f32 = 4.0;
// How often a box shrinks to what its own extreme reaches.
const SHRINKS: i32 = 4;
const INFINITY: u32 = 0x7f800000u;

struct Kept {
    small_count: atomic<u32>,
    large_count: atomic<u32>,
    // Of the dispatches that draw them.
    small_groups: array<u32, 3>,
    large_groups: array<u32, 3>,
    // In the list: of small ones from the front, of large ones from the back.
    places: array<u32>,
}

@group(0) @binding(0) var<uniform> reach: Reach;
// Of every tile the least w, as the complement of its bits; 0 where nothing is.
@group(0) @binding(1) var<storage, read_write> receivers: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read> list: array<Parallelogram>;
@group(0) @binding(3) var<storage, read_write> kept: Kept;
@group(0) @binding(4) var<uniform> camera: Pinhole;
@group(0) @binding(5) var<uniform> frame: Frame;
@group(0) @binding(6) var w: texture_2d<f32>;
@group(0) @binding(7) var<uniform> level: vec4u;

// The tile of a place in the frame's image, from its centre; what lies beside the image counts in the tiles of its rim.
fn reach_tile(image: vec2f) -> vec2u {
    return vec2u(clamp((image + reach.centre_px) / TILE_PX, vec2f(0.0), vec2f(reach.levels[0].xy) - 1.0));
}

// The least w of the tiles that a box touches, and of a few more; infinite where nothing is. The level is that at which at most four lie in a row.
fn least_w(low: vec2f, high: vec2f) -> f32 {
    let first = reach_tile(low);
    let last = reach_tile(high);
    let span = max(last.x - first.x, last.y - first.y);
    let level = select(0u, firstLeadingBit(max(span, 1u)) - 1u, span >= 4u);
    let tiles = reach.levels[level];
    var most = 0u;
    for (var y = first.y >> level; y <= last.y >> level; y++) {
        for (var x = first.x >> level; x <= last.x >> level; x++) {
            most = max(most, atomicLoad(&receivers[tiles.z + y * tiles.x + x]));
        }
    }
    return bitcast<f32>(select(~most, INFINITY, most == 0u));
}

// Whether a caster whose greatest w is `w` may hide a receiver, if it reaches `extent` pixels to each side of `image`.
fn may_hide(image: vec2f, extent: vec2f, w: f32) -> bool {
    // In the map of a point that shifts by s, caster and receiver fall together where receiver = caster - s (w - receiver_w).
    var way = w;
    for (var shrink = 0; shrink < SHRINKS && way > 0.0; shrink++) {
        let low = image - extent - max(way * reach.greatest_shift, vec2f(0.0));
        let high = image + extent - min(way * reach.least_shift, vec2f(0.0));
        way = w - least_w(low, high);
    }
    return way > 0.0;
}

@compute @workgroup_size(8, 8)
fn receive(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(w)) {
        return;
    }
    let inverse_depth = textureLoad(w, vec2i(id.xy), 0).x;
    if inverse_depth == 0.0 {
        return;
    }
    let point = pinhole_eye_from_image(camera, vec2f(id.xy) + 0.5, inverse_depth) * camera.eye_from_world;
    let p = frame.frame_from_view * vec4f(point, 1.0);
    if p.z < frame.near_m {
        return;
    }
    let own_w = 1.0 / p.z;
    let tile = reach_tile(frame.focal_px * p.xy * own_w);
    let tiles = reach.levels[0];
    atomicMax(&receivers[tiles.z + tile.y * tiles.x + tile.x], ~bitcast<u32>(own_w));
}

@compute @workgroup_size(64)
fn keep(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * reach.row + id.x;
    if index >= arrayLength(&list) || list[index].middle.z <= 0.0 {
        return;
    }
    let shape = list[index];
    let extent = abs(shape.right.xyz) + abs(shape.down.xyz);
    if !may_hide(shape.middle.xy, extent.xy + 1.0, shape.middle.z + shape.middle.w + extent.z) {
        return;
    }
    // No point sees it larger than this.
    let widest = extent.xy + extent.z * max(abs(reach.least_shift), abs(reach.greatest_shift));
    if all(widest < vec2f(1.0)) {
        kept.places[atomicAdd(&kept.small_count, 1u)] = index;
    } else {
        kept.places[arrayLength(&list) - 1u - atomicAdd(&kept.large_count, 1u)] = index;
    }
}

@compute @workgroup_size(1)
fn arrange() {
    kept.small_groups = groups(atomicLoad(&kept.small_count));
    kept.large_groups = groups(atomicLoad(&kept.large_count));
}

// Of 64, in rows.
fn groups(count: u32) -> array<u32, 3> {
    let groups = (count + 63u) / 64u;
    let in_row = reach.row / 64u;
    return array<u32, 3>(min(groups, in_row), (groups + in_row - 1u) / in_row, 1u);
}

// A tile of `level.x` from its four of the level before.
@compute @workgroup_size(8, 8)
fn coarsen(@builtin(global_invocation_id) id: vec3u) {
    let tiles = reach.levels[level.x];
    let finer = reach.levels[level.x - 1u];
    if any(id.xy >= tiles.xy) {
        return;
    }
    var most = 0u;
    for (var index = 0u; index < 4u; index++) {
        let tile = min(2u * id.xy + vec2u(index & 1u, index >> 1u), finer.xy - 1u);
        most = max(most, atomicLoad(&receivers[finer.z + tile.y * finer.x + tile.x]));
    }
    atomicStore(&receivers[tiles.z + id.y * tiles.x + id.x], most);
}
