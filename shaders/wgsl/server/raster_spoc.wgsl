// Entry points of the pass that draws a single-pole occlusion camera's image: triangles cut into pieces, as
// `server/split_levels.wgsl` says, whose corners are pushed.
#import "server/split.wgsl"
#import "server/targets.wgsl"

@group(3) @binding(1) var<storage, read> items: array<Item>;
@group(3) @binding(2) var<storage, read> starts: array<u32>;

// The triangle that a piece belongs to: the last that begins at it or before.
fn item_of(piece: u32) -> u32 {
    var low = 0u;
    var high = split.item_count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if starts[middle] <= piece {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// A corner of a piece, in steps from the second and third corner's opposite sides; the first has the rest. Pieces stand
// in rows from the first corner on, row r with 2 r + 1 of them, every other one upside down.
fn lattice_point(piece: u32, corner: u32) -> vec2u {
    var row = u32(sqrt(f32(piece)));
    // The root may be rounded to either side.
    row -= select(0u, 1u, row * row > piece);
    row += select(0u, 1u, (row + 1u) * (row + 1u) <= piece);
    let place = piece - row * row;
    let column = place / 2u;
    let steps = u32(corner > 0u);
    // Row and column of the corner.
    var at = vec2u(row + steps, column + u32(corner == 2u));
    if place % 2u == 1u {
        at = vec2u(row + u32(corner == 1u), column + steps);
    }
    return vec2u(at.x - at.y, at.y);
}

fn is_before(a: vec3f, b: vec3f) -> bool {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)));
}

struct Point {
    position: vec3f,
    // Of the triangle's corners.
    weights: vec3f,
}

// A point on an edge, moved to the next step of the edge's own level; in the middle between two, backwards. It is
// computed from the same end in both triangles of the edge, so that they meet.
fn edge_point(a: vec3f, b: vec3f, steps: u32, level_inside: u32, level: u32) -> Point {
    let step = (2u * steps * level + level_inside - 1u) / (2u * level_inside);
    let forward = is_before(a, b);
    let from_first = select(level - step, step, forward);
    let share = f32(from_first) / f32(level);
    let first = select(b, a, forward);
    let second = select(a, b, forward);
    var position = first * (1.0 - share) + second * share;
    if from_first == level {
        position = second;
    }
    let b_share = f32(step) / f32(level);
    return Point(position, vec3f(1.0 - b_share, b_share, 0.0));
}

fn point_at(p: array<vec3f, 3>, levels: u32, steps: vec2u) -> Point {
    let inside = level_inside(levels);
    if steps.y == 0u {
        return edge_point(p[0], p[1], steps.x, inside, levels & 0xffu);
    }
    if steps.x + steps.y == inside {
        var point = edge_point(p[1], p[2], steps.y, inside, (levels >> 8u) & 0xffu);
        point.weights = point.weights.zxy;
        return point;
    }
    if steps.x == 0u {
        var point = edge_point(p[2], p[0], inside - steps.y, inside, (levels >> 16u) & 0xffu);
        point.weights = point.weights.yzx;
        return point;
    }
    let shares = vec2f(steps) / f32(inside);
    let weights = vec3f(1.0 - shares.x - shares.y, shares);
    return Point(p[0] * weights.x + p[1] * weights.y + p[2] * weights.z, weights);
}

@vertex
fn vertex(@builtin(vertex_index) place: u32) -> Varying {
    let piece = place / 3u;
    let index = item_of(piece);
    let item = items[index];
    let a = pulled_corner(item.first_corner, item.instance);
    let b = pulled_corner(item.first_corner + 1u, item.instance);
    let c = pulled_corner(item.first_corner + 2u, item.instance);
    let steps = lattice_point(piece - starts[index], place % 3u);
    let point = point_at(array(a.position, b.position, c.position), item.levels, steps);
    let weights = point.weights;
    var v = a;
    v.position = point.position;
    v.clip = spoc_clip_from_eye(camera, split.push, camera.eye_from_world * point.position);
    v.normal_world = a.normal_world * weights.x + b.normal_world * weights.y + c.normal_world * weights.z;
    v.uv = a.uv * weights.x + b.uv * weights.y + c.uv * weights.z;
    v.second_uv = a.second_uv * weights.x + b.second_uv * weights.y + c.second_uv * weights.z;
    v.colour = a.colour * weights.x + b.colour * weights.y + c.colour * weights.z;
    return v;
}

@fragment
fn plain(v: Varying, @builtin(front_facing) front: bool) -> ImageTargets {
    return plain_fragment(v, front, v.triangle);
}
