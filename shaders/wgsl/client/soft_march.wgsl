// Which pixels do not see some of a lamp's points, by rays through the images of its corners: see `client::soft::march`.
#import "client/fullscreen.wgsl"
#import "client/soft_receiver.wgsl"

const CORNERS: u32 = 4u;

struct Corners {
    // By how much a point at w = 1 shifts in x and y; then the image's centre.
    places: array<vec4f, CORNERS>,
    // Of each image.
    size_px: vec2u,
    padding_0: u32,
    padding_1: u32,
}

@group(0) @binding(6) var<uniform> corners: Corners;
// The planes of texels, w and its change a pixel to the right and down; least and greatest w of 4 x 4 and of 16 x 16. A layer for each corner.
@group(0) @binding(7) var planes: texture_2d_array<f32>;
@group(0) @binding(8) var spans_of_4: texture_2d_array<f32>;
@group(0) @binding(9) var spans_of_16: texture_2d_array<f32>;

// Cells that a ray comes through at most in one image; what it did not meet by then it passes.
const MOST_STEPS: i32 = 256;
// Of cells: 0 of a texel, 1 of 4 x 4, 2 of 16 x 16. Rays begin in the middle.
const FIRST_LEVEL: u32 = 1u;
const TOP_LEVEL: u32 = 2u;
// How far beyond a cell's side the next cell is looked up, in pixels: coordinates of a few thousand are rounded by less.
const BEYOND_PX: f32 = 1e-3;
// An inverse depth that no ray comes to, and a number: an f32 goes up to 3.4e38.
const NEVER: f32 = 3e38;
// Where a surface ends it draws back as far, as rebuilt ones do at outlines: see `Rim` of `surface::corners`.
const RIM_PX: f32 = 0.2;
// A texel continues another's plane up to as many footprints.
const CONTINUED: f32 = 1.5;

// Of the cell that a texel lies in.
fn span_at(level: u32, texel: vec2i, layer: u32) -> vec2f {
    if level == 1u {
        return textureLoad(spans_of_4, texel >> vec2u(2u), layer, 0).xy;
    }
    return textureLoad(spans_of_16, texel >> vec2u(4u), layer, 0).xy;
}

// Whether a texel's surface reaches `place`, pixels from its middle: it does not where it ends on that side, and draws back from there.
fn is_covered(layer: u32, texel: vec2i, plane: vec3f, place: vec2f) -> bool {
    let last = vec2i(corners.size_px) - 1;
    let most_apart = CONTINUED * plane.x / frame.focal_px;
    let next = vec2i(sign(place));
    let beside = textureLoad(planes, clamp(texel + vec2i(next.x, 0), vec2i(0), last), layer, 0).x;
    let below = textureLoad(planes, clamp(texel + vec2i(0, next.y), vec2i(0), last), layer, 0).x;
    let apart = abs(vec2f(beside, below) - plane.x - vec2f(next) * plane.yz);
    let ends = apart > vec2f(most_apart);
    return !any(ends & (abs(place) > vec2f(0.5 - RIM_PX)));
}

// Whether something of one corner's image lies between the receiver, which is seen at `start` there, and a point towards which it moves by `way`
// pixels while w grows by 1. `facing`: the cosine to the corner times distance and focal length.
fn is_blocked(layer: u32, receiver: Receiver, start: vec2f, way: vec2f, facing: f32) -> bool {
    let size = vec2f(corners.size_px);
    let most_w = 1.0 / frame.near_m;
    let side = select(vec2f(0.0), vec2f(1.0), way > vec2f(0.0));
    let beyond = BEYOND_PX * sign(way);
    var level = FIRST_LEVEL;
    var at_w = receiver.own_w;
    for (var step = 0; step < MOST_STEPS && at_w < most_w; step++) {
        let place = start + (at_w - receiver.own_w) * way + beyond;
        if any(place < vec2f(0.0)) || any(place >= size) {
            return false;
        }
        let texel = vec2i(place);
        let cell = texel >> vec2u(2u * level);
        let sides = (vec2f(cell) + side) * f32(1u << (2u * level));
        let leaves = select(receiver.own_w + (sides - start) / way, vec2f(NEVER), way == vec2f(0.0));
        let end_w = clamp(min(leaves.x, leaves.y), at_w, most_w);
        if level > 0u {
            let span = span_at(level, texel, layer);
            if span.y < at_w || span.x > end_w {
                at_w = end_w;
                level = min(level + 1u, TOP_LEVEL);
            } else {
                level--;
            }
            continue;
        }
        let plane = textureLoad(planes, texel, layer, 0);
        let way_from_middle = start - vec2f(texel) - 0.5;
        // Above it where the ray comes in and where it leaves.
        let above = vec2f(at_w, end_w) - plane.x
            - vec2f(
                dot(plane.yz, way_from_middle + (at_w - receiver.own_w) * way),
                dot(plane.yz, way_from_middle + (end_w - receiver.own_w) * way),
            );
        let is_met = plane.x > 0.0 && min(above.x, above.y) <= 0.0 && max(above.x, above.y) >= 0.0;
        // As in `client/soft_compare.wgsl`, with both sides of the comparison times the cosine.
        let over = (plane.x - receiver.least_w) * facing - dot(receiver.normal.xy, way_from_middle);
        if is_met && over > receiver.rise {
            let met_w = at_w + (end_w - at_w) * clamp(above.x / (above.x - above.y), 0.0, 1.0);
            if is_covered(layer, texel, plane.xyz, way_from_middle + (met_w - receiver.own_w) * way) {
                return true;
            }
        }
        at_w = end_w;
        level = select(1u, 0u, plane.x > 0.0);
    }
    return false;
}

@fragment
fn hidden_by_march(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let sum = hidden_weights(receiver_at(position));
    if all(sum == vec4f(0.0)) {
        discard;
    }
    return sum;
}

// Returns early where nothing is: what is discarded may go on, and pay for the rays.
fn hidden_weights(receiver: Receiver) -> vec4f {
    var sum = vec4f(0.0);
    if receiver.own_w == 0.0 {
        return sum;
    }
    for (var index = 0u; index < points.point_count; index++) {
        let shift = points.places[index].xy;
        var is_hidden = receiver.facing + dot(receiver.normal.xy, shift) <= 0.0;
        for (var layer = 0u; layer < CORNERS && !is_hidden; layer++) {
            let corner = corners.places[layer];
            let start = receiver.image_px - corner.xy * receiver.own_w + corner.zw;
            let facing = receiver.facing + dot(receiver.normal.xy, corner.xy);
            is_hidden = is_blocked(layer, receiver, start, shift - corner.xy, facing);
        }
        if is_hidden {
            sum += points.weights[index];
        }
    }
    return sum;
}
