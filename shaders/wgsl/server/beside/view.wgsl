// A view of the scene beside the same view of what a client holds, as `server::account::compare` lays them: planes of one camera. The twin of
// that file, function by function; what differs is said there and here.
#import "common/octahedral.wgsl"

// The twin of `server::beside::uniforms::BesideUniform`.
struct Beside {
    // Axes of the eye in world space: `ray_world = right * x' + down * y' + forward`.
    right: vec3f,
    // Of the view, pixels.
    focal_px: f32,
    down: vec3f,
    // Metres.
    near_m: f32,
    forward: vec3f,
    // Number of the look.
    look: u32,
    centre_px: vec2f,
    size_px: vec2u,
    // Of `server::account::AccountRules`.
    off_plane_footprints: f32,
    along_ray_footprints: f32,
    normal_cos: f32,
    density_factor: f32,
    // See FLAG_*.
    flags: u32,
    border_px: u32,
    // Nothing is sent of a view that lacks no more pixels than this.
    least_px: f32,
    patches: u32,
    // Room in `told`.
    most_addresses: u32,
    // Room in `samples_out`.
    most_samples: u32,
    // Slots in use, of deleted samples and removed patches too.
    slots: u32,
    padding: u32,
}

const FLAG_OUTLINES_STAND_IN: u32 = 1u;
const FLAG_REFINES: u32 = 2u;
const FLAG_TRIMS: u32 = 4u;
const FLAG_SUPERSEDES: u32 = 8u;
const FLAG_SEEN: u32 = 16u;

// A held patch. The twin of `server::beside::uniforms::PatchRow`.
struct Patch {
    // Rows of the map from the patch's eye to the view's.
    eye_from_patch: array<vec4f, 3>,
    // Of the patch's image, pixels.
    centre_px: vec2f,
    focal_px: f32,
    // Step of its coded inverse depths, 1/m.
    w_step: f32,
    id: u32,
    // Its first word in `words`, and of which width its image is in pixels.
    first_word: u32,
    width_px: u32,
    // Its first mover in `movers`.
    first_mover: u32,
    // Its samples' slots.
    first_slot: u32,
    slots: u32,
    // See PATCH_*.
    flags: u32,
    padding: u32,
    // Where in the view's image its own begins, of one that is cut from a view of this very camera.
    cut_px: vec2u,
    padding_2: vec2u,
}

// A view of the same plan captured it: its samples are not replaced.
const PATCH_PEER: u32 = 1u;
// It is cut from a view of this very camera.
const PATCH_CUT: u32 = 2u;

// A rigid object in a patch. The twin of `server::beside::uniforms::MoverRow`.
struct Mover {
    eye_from_patch: array<vec4f, 3>,
    // 1 where it is no longer where it was captured.
    carried: u32,
    padding: u32,
    padding_2: u32,
    padding_3: u32,
}

// What is known of a held sample beside what a view shows of it. The twin of `server::account::facts::SampleFacts`.
struct Sample {
    triangle: u32,
    // Samples an area, 1/m².
    density: f32,
    // Inverse depth, 1/m.
    w: f32,
    // x in the low half, y in the high one.
    pixel: u32,
    // Octahedral normal in the low half, object in the high one.
    normal_object: u32,
    // 1 + the number of its object among the patch's moving ones, 0 of what never moves.
    mover: u32,
}

// 32 pixels of a patch's image. The twin of `server::account::facts::Word`.
struct Word {
    // Which of them were captured, lowest bit first, and which of these are still held.
    captured: u32,
    held: u32,
    // The slot of the first of them.
    first_slot: u32,
    padding: u32,
}

// What is found out of a pixel.
struct Pixel {
    // Of the held sample that shows there, or NO_SLOT.
    slot: u32,
    verdict: u32,
    // The triangle of the sample that is held from this very camera; 0 of none.
    sent: u32,
    // 1 where it is to be sent.
    send: u32,
    // How densely its hit is sampled by what shows once all is sent; 0 where nothing does.
    shown: f32,
    // Where its surface ends, of what is sent: `protocol::ends`.
    ends: u32,
}

const NO_SLOT: u32 = 0xffffffffu;

const LEAVE: u32 = 0u;
const MISSING: u32 = 1u;
const COARSE: u32 = 2u;
const TURNED: u32 = 3u;

// `marks` begins with counters.
const MISSING_COUNT: u32 = 0u;
const HITS_COUNT: u32 = 1u;
const SAMPLES_COUNT: u32 = 2u;
const ADDRESSES_COUNT: u32 = 3u;
const COUNTERS: u32 = 16u;

// Of a slot, in `marks`.
const GOES: u32 = 1u;
const TURNS: u32 = 2u;
const STAYS: u32 = 4u;
const TOLD: u32 = 8u;

// What an address is told for.
const FALSE_COVER: u32 = 0u;
const REPLACED: u32 = 1u;
const SUPERSEDED: u32 = 2u;

@group(0) @binding(0) var<uniform> beside: Beside;
// The scene: triangle, object and normal; colour and material; what codes leave off; near / z.
@group(0) @binding(1) var ids: texture_2d<u32>;
@group(0) @binding(2) var colour: texture_2d<f32>;
@group(0) @binding(3) var rests: texture_2d<u32>;
@group(0) @binding(4) var depth: texture_depth_2d;
// The copy: `surface::AddressTexel`.
@group(0) @binding(5) var addresses: texture_2d<u32>;
// By patch, ids ascending.
@group(0) @binding(6) var<storage, read> patches: array<Patch>;
@group(0) @binding(7) var<storage, read> movers: array<Mover>;
@group(0) @binding(8) var<storage, read> words: array<Word>;
@group(0) @binding(9) var<storage, read> samples: array<Sample>;
// By slot: the last look that showed it.
@group(0) @binding(10) var<storage, read_write> seen: array<u32>;
// Counters, and what is found out of each slot.
@group(0) @binding(11) var<storage, read_write> marks: array<atomic<u32>>;
@group(0) @binding(12) var<storage, read_write> pixels: array<Pixel>;
// Six words a sample that is sent: place; the texels of `ids`, `colour` and `rests`, with its ends in the latter's high half; the texel of `depth`.
@group(0) @binding(13) var<storage, read_write> samples_out: array<u32>;
// Three words an address: patch, pixel, what for.
@group(0) @binding(14) var<storage, read_write> told: array<u32>;

// A point of a surface as one pixel shows it.
struct Point {
    w: f32,
    normal: vec3f,
    object: u32,
    triangle: u32,
    w_step: f32,
    density: f32,
    // Whether there is one.
    is_there: bool,
}

fn nothing() -> Point {
    return Point(0.0, vec3f(0.0, 0.0, 1.0), 0u, 0u, 0.0, 0.0, false);
}

fn has(flag: u32) -> bool {
    return (beside.flags & flag) != 0u;
}

fn is_inside(p: vec2i) -> bool {
    return all(p >= vec2i(0)) && all(p < vec2i(beside.size_px));
}

fn at(p: vec2i) -> u32 {
    return u32(p.y) * beside.size_px.x + u32(p.x);
}

// What stands at a pixel; of what only hides, without a triangle.
fn stands_at(p: vec2i) -> Point {
    if !is_inside(p) {
        return nothing();
    }
    let id = textureLoad(ids, p, 0).xy;
    let w = textureLoad(depth, p, 0) / beside.near_m;
    return Point(w, octahedral_normal(id.y >> 16u), id.y & 0xffffu, id.x, 0.0, 0.0, id.x != 0u || w > 0.0);
}

// The hit of the scene at a pixel.
fn truth_at(p: vec2i) -> Point {
    let point = stands_at(p);
    if point.triangle == 0u {
        return nothing();
    }
    return point;
}

// The place in `patches` of an id; `patches` of none.
fn patch_of(id: u32) -> u32 {
    var low = 0u;
    var high = beside.patches;
    while low < high {
        let middle = (low + high) / 2u;
        if patches[middle].id < id {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if low < beside.patches && patches[low].id == id {
        return low;
    }
    return beside.patches;
}

// The place in `patches` of a slot's; `patches` of none. Slots ascend with ids.
fn patch_of_slot(slot: u32) -> u32 {
    var low = 0u;
    var high = beside.patches;
    while low < high {
        let middle = (low + high) / 2u;
        if patches[middle].first_slot + patches[middle].slots <= slot {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if low < beside.patches && slot >= patches[low].first_slot {
        return low;
    }
    return beside.patches;
}

fn word_of(place: u32, pixel: u32) -> vec2u {
    let bit = (pixel >> 16u) * patches[place].width_px + (pixel & 0xffffu);
    return vec2u(patches[place].first_word + bit / 32u, bit % 32u);
}

// Where a sample lies in `samples`; NO_SLOT of none.
fn slot_of(place: u32, pixel: u32) -> u32 {
    if place >= beside.patches {
        return NO_SLOT;
    }
    let word = word_of(place, pixel);
    let captured = words[word.x].captured;
    if ((captured >> word.y) & 1u) == 0u {
        return NO_SLOT;
    }
    return words[word.x].first_slot + countOneBits(captured & ((1u << word.y) - 1u));
}

fn is_held(place: u32, pixel: u32) -> bool {
    let word = word_of(place, pixel);
    return ((words[word.x].held >> word.y) & 1u) != 0u;
}

// What the copy shows at a pixel, once `begin` has found the slots. An unknown sample is of no triangle, and infinitely dense.
fn held_at(p: vec2i) -> Point {
    if !is_inside(p) {
        return nothing();
    }
    let texel = textureLoad(addresses, p, 0);
    if texel.x == 0u {
        return nothing();
    }
    let slot = pixels[at(p)].slot;
    let normal = octahedral_normal(texel.z & 0xffffu);
    if slot == NO_SLOT {
        return Point(bitcast<f32>(texel.w), normal, texel.z >> 16u, 0u, 0.0, 3e38, true);
    }
    let place = patch_of(texel.x);
    let w_step = patches[place].w_step;
    return Point(bitcast<f32>(texel.w), normal, texel.z >> 16u, samples[slot].triangle, w_step, samples[slot].density, true);
}

// The ray of a pixel's centre in the axes of the world.
fn ray(p: vec2i) -> vec3f {
    let tangents = (vec2f(p) + 0.5 - beside.centre_px) / beside.focal_px;
    return beside.right * tangents.x + beside.down * tangents.y + beside.forward;
}

// `w` of a point's plane at the pixel `there`, the point's own being `here`; its own `w` where the plane is seen edge-on.
fn w_on_plane(point: Point, here: vec2i, there: vec2i) -> f32 {
    if all(here == there) {
        return point.w;
    }
    let w = point.w * dot(point.normal, ray(there)) / dot(point.normal, ray(here));
    return select(point.w, w, w > 0.0 && w < 3e38);
}

// How far apart in `w` two points of one surface may be at a pixel.
fn tolerance(a: Point, b: Point, p: vec2i) -> f32 {
    let r = ray(p);
    // Never divides by 0. Seen edge-on the second of two bounds is the smaller one, so any number does that is far below their quotient, 0.15.
    let facing = max(max(abs(dot(a.normal, r)), abs(dot(b.normal, r))), 1e-20);
    let footprint = a.w / beside.focal_px;
    let off_plane = min(beside.off_plane_footprints / facing, beside.along_ray_footprints);
    return footprint * off_plane + max(a.w_step, b.w_step);
}

// Whether the hit of pixel `p` lies on the held surface that pixel `held_p` shows.
fn is_in_place(hit: Point, held: Point, p: vec2i, held_p: vec2i) -> bool {
    return hit.object == held.object && abs(hit.w - w_on_plane(held, held_p, p)) <= tolerance(hit, held, p);
}

fn is_same_way(hit: Point, held: Point) -> bool {
    return hit.triangle == held.triangle || dot(hit.normal, held.normal) >= beside.normal_cos;
}

fn is_held_at(p: vec2i, held_p: vec2i) -> bool {
    let hit = truth_at(p);
    let held = held_at(held_p);
    return hit.is_there && held.is_there && is_in_place(hit, held, p, held_p) && is_same_way(hit, held);
}

fn is_one_surface(a: Point, b: Point, p: vec2i, b_p: vec2i) -> bool {
    let apart = abs(b.w - w_on_plane(a, p, b_p));
    return a.object == b.object && apart <= max(tolerance(a, b, p), 2.0 * a.w / beside.focal_px);
}

// How densely the view itself samples the hit of a pixel; 0 where there is none.
fn view_density(p: vec2i) -> f32 {
    let hit = truth_at(p);
    return beside.focal_px * beside.focal_px * abs(dot(hit.normal, ray(p))) * hit.w * hit.w;
}

// Notes an address, if there is room.
fn tell(id: u32, pixel: u32, reason: u32) {
    let number = atomicAdd(&marks[ADDRESSES_COUNT], 1u);
    if number < beside.most_addresses {
        told[3u * number] = id;
        told[3u * number + 1u] = pixel;
        told[3u * number + 2u] = reason;
    }
}

// A point of a patch's image in the view's eye space, times `w`.
fn eye_times_w(place: u32, mover: u32, image: vec2f, w: f32) -> vec3f {
    let point = vec4f((image - patches[place].centre_px) / patches[place].focal_px, 1.0, w);
    var rows = patches[place].eye_from_patch;
    if mover != 0u {
        rows = movers[patches[place].first_mover + mover - 1u].eye_from_patch;
    }
    return vec3f(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
}

fn is_carried(place: u32, mover: u32) -> bool {
    return mover != 0u && movers[patches[place].first_mover + mover - 1u].carried != 0u;
}

fn pixel_centre(pixel: u32) -> vec2f {
    return vec2f(f32(pixel & 0xffffu), f32(pixel >> 16u)) + 0.5;
}
