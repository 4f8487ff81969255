// Entry points of the passes that say into how many pieces each triangle is cut, and where its pieces stand among all.
#import "server/split.wgsl"

// Triangles of instances in a row, which one call draws: those of the first instance first. One more stands at the end.
struct SplitRun {
    first_item: u32,
    triangles: u32,
    first_instance: u32,
    first_index: u32,
}

@group(3) @binding(1) var<storage, read_write> items: array<Item>;
@group(3) @binding(2) var<storage, read_write> starts: array<u32>;
@group(3) @binding(3) var<storage, read> runs: array<SplitRun>;
@group(3) @binding(4) var<storage, read_write> calls: array<vec4u>;

// What tells how far the image of something bows, if it is one piece.
struct Bow {
    // The length of its straight image, as if all of it were as near as its nearest point.
    step_px: f32,
    // By how much the push changes along it, in the same way.
    change_px: f32,
    // The greatest push.
    push_px: f32,
    // The distances from the pole in the straight image.
    nearest_px: f32,
    furthest_px: f32,
    // How often the push begins or ends to change.
    kinks: f32,
    // How sharply the ramp's border is crossed, and how often.
    crossing: f32,
}

// `A` and `B` of the bound.
fn level_of(bow: Bow, inside: f32) -> u32 {
    let ramp_px = split.push.ramp_px;
    let rho_px = max(bow.nearest_px, ramp_px);
    let shares = bow.step_px / rho_px;
    var curved = bow.change_px * shares;
    var kinks = bow.kinks * bow.change_px;
    if bow.furthest_px > ramp_px {
        curved += 0.57736 * bow.push_px * shares * shares;
        if bow.nearest_px < ramp_px {
            kinks += bow.crossing * bow.step_px * bow.push_px / ramp_px;
        }
    }
    curved *= inside;
    let level = ceil(0.5 * (kinks + sqrt(kinks * kinks + 4.0 * curved)));
    // Written so that what is not a number is cut finely.
    return select(split.level_cap, u32(max(level, 1.0)), level <= f32(split.level_cap));
}

// The pole is the origin.
fn nearest_on_segment_px(a_px: vec2f, b_px: vec2f) -> f32 {
    let along = b_px - a_px;
    let squared = dot(along, along);
    let share = select(0.0, clamp(-dot(a_px, along) / squared, 0.0, 1.0), squared > 0.0);
    return length(a_px + along * share);
}

fn straight_px(p_eye: vec3f) -> vec2f {
    return straight_px_m(camera, split.push, p_eye) / p_eye.z;
}

fn no_bow() -> Bow {
    return Bow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

// A function of the two ends alone, whichever comes first: both triangles of an edge cut it alike.
fn bow_of_edge(a_eye: vec3f, b_eye: vec3f) -> Bow {
    let push = split.push;
    let left = a_eye.x < b_eye.x || (a_eye.x == b_eye.x && a_eye.y < b_eye.y);
    let first = a_eye.z < b_eye.z || (a_eye.z == b_eye.z && left);
    var near_eye = select(b_eye, a_eye, first);
    let far_eye = select(a_eye, b_eye, first);
    if far_eye.z <= push.from_m {
        return no_bow();
    }
    var share = 1.0;
    var kinks = 0.0;
    if near_eye.z < push.from_m {
        share = (far_eye.z - push.from_m) / (far_eye.z - near_eye.z);
        near_eye = vec3f(mix(far_eye.xy, near_eye.xy, share), push.from_m);
        kinks = 1.0;
    }
    let stretch = far_eye.z / (near_eye.z * share);
    let a_px = straight_px(near_eye);
    let b_px = straight_px(far_eye);
    var bow = no_bow();
    bow.step_px = distance(a_px, b_px) * stretch;
    if near_eye.z < push.to_m {
        bow.change_px = push_rate(push) * (1.0 / near_eye.z - 1.0 / far_eye.z) * stretch;
        kinks += select(0.0, 1.0, far_eye.z > push.to_m);
    }
    bow.push_px = push_px(push, far_eye.z);
    bow.nearest_px = nearest_on_segment_px(a_px, b_px);
    bow.furthest_px = max(length(a_px), length(b_px));
    bow.kinks = kinks;
    bow.crossing = 1.0;
    if min(length(a_px), length(b_px)) > push.ramp_px && bow.nearest_px < push.ramp_px {
        let cosine = sqrt(1.0 - pow(bow.nearest_px / push.ramp_px, 2.0));
        // Where a piece is shorter than the chord, it has one of the two crossings.
        bow.crossing = cosine * select(2.0, 1.0, 2.0 * bow.push_px * cosine * cosine >= 1.0);
    }
    return bow;
}

fn cross_2d(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Of the inside of a triangle, from those of its edges.
fn bow_inside(p_eye: array<vec3f, 3>, edges: array<Bow, 3>) -> Bow {
    let push = split.push;
    var bow = edges[0];
    for (var edge = 1u; edge < 3u; edge++) {
        bow.step_px = max(bow.step_px, edges[edge].step_px);
        bow.change_px = max(bow.change_px, edges[edge].change_px);
        bow.push_px = max(bow.push_px, edges[edge].push_px);
        bow.nearest_px = min(bow.nearest_px, edges[edge].nearest_px);
        bow.furthest_px = max(bow.furthest_px, edges[edge].furthest_px);
    }
    let least_m = min(p_eye[0].z, min(p_eye[1].z, p_eye[2].z));
    let most_m = max(p_eye[0].z, max(p_eye[1].z, p_eye[2].z));
    bow.kinks = select(0.0, 1.0, least_m < push.from_m && most_m > push.from_m)
        + select(0.0, 1.0, least_m < push.to_m && most_m > push.to_m);
    bow.crossing = 1.0;
    if least_m < push.from_m {
        bow.nearest_px = 0.0;
        return bow;
    }
    let a_px = straight_px(p_eye[0]);
    let b_px = straight_px(p_eye[1]);
    let c_px = straight_px(p_eye[2]);
    let longest_px = max(distance(a_px, b_px), max(distance(b_px, c_px), distance(c_px, a_px)));
    bow.step_px = longest_px * most_m / least_m;
    bow.change_px = select(0.0, push_rate(push) * (most_m - least_m) / (least_m * least_m), least_m < push.to_m);
    let turns = vec3f(cross_2d(a_px, b_px), cross_2d(b_px, c_px), cross_2d(c_px, a_px));
    if all(turns >= vec3f(0.0)) || all(turns <= vec3f(0.0)) {
        bow.nearest_px = 0.0;
    }
    return bow;
}

// Whether the image may show some of a triangle.
fn may_be_seen(p_eye: array<vec3f, 3>) -> bool {
    let least_m = min(p_eye[0].z, min(p_eye[1].z, p_eye[2].z));
    let most_m = max(p_eye[0].z, max(p_eye[1].z, p_eye[2].z));
    if most_m < camera.near_m {
        return false;
    }
    if least_m < camera.near_m {
        return true;
    }
    let a_px = straight_px(p_eye[0]);
    let b_px = straight_px(p_eye[1]);
    let c_px = straight_px(p_eye[2]);
    // The deepest are pushed furthest; and a pixel for rounding.
    let slack_px = push_px(split.push, most_m) + 1.0;
    let low_px = min(a_px, min(b_px, c_px)) + split.push.pole_px - slack_px;
    let high_px = max(a_px, max(b_px, c_px)) + split.push.pole_px + slack_px;
    return all(low_px < camera.size_px) && all(high_px > vec2f(0.0));
}

fn levels_of(instance: u32, first_corner: u32) -> u32 {
    var p_eye: array<vec3f, 3>;
    for (var index = 0u; index < 3u; index++) {
        p_eye[index] = camera.eye_from_world * pulled_corner(first_corner + index, instance).position;
    }
    if !may_be_seen(p_eye) {
        return 0u;
    }
    var edges: array<Bow, 3>;
    var levels = 0u;
    var most = 1u;
    for (var index = 0u; index < 3u; index++) {
        edges[index] = bow_of_edge(p_eye[index], p_eye[(index + 1u) % 3u]);
        let level = level_of(edges[index], 1.0);
        levels |= level << (8u * index);
        most = max(most, level);
    }
    most = max(most, level_of(bow_inside(p_eye, edges), 4.0 / 3.0));
    return levels | (most << 24u);
}

fn run_of(item: u32) -> u32 {
    var low = 0u;
    var high = split.run_count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if runs[middle].first_item <= item {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

@compute @workgroup_size(64)
fn cut(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var index = id.x; index < split.item_count; index += groups.x * 64u) {
        let run = runs[run_of(index)];
        let place = index - run.first_item;
        let instance = run.first_instance + place / run.triangles;
        let first_corner = run.first_index + 3u * (place % run.triangles);
        items[index] = Item(instance, first_corner, levels_of(instance, first_corner));
    }
}

const LANES: u32 = 256u;
var<workgroup> sums: array<u32, LANES>;

// One group counts all pieces: each lane those of a share of the items.
@compute @workgroup_size(256)
fn count(@builtin(local_invocation_index) lane: u32) {
    let share = (split.item_count + LANES - 1u) / LANES;
    let first = min(lane * share, split.item_count);
    let end = min(first + share, split.item_count);
    var sum = 0u;
    for (var index = first; index < end; index++) {
        sum += piece_count(items[index]);
    }
    sums[lane] = sum;
    workgroupBarrier();
    for (var step = 1u; step < LANES; step *= 2u) {
        var before = 0u;
        if lane >= step {
            before = sums[lane - step];
        }
        workgroupBarrier();
        sums[lane] += before;
        workgroupBarrier();
    }
    var start = sums[lane] - sum;
    for (var index = first; index < end; index++) {
        starts[index] = start;
        start += piece_count(items[index]);
    }
    if lane == LANES - 1u {
        starts[split.item_count] = start;
    }
    storageBarrier();
    for (var run = lane; run < split.run_count; run += LANES) {
        let begin = starts[runs[run].first_item];
        let behind = starts[runs[run + 1u].first_item];
        // Vertices, instances, first vertex, first instance.
        calls[run] = vec4u(3u * (behind - begin), 1u, 3u * begin, 0u);
    }
}
