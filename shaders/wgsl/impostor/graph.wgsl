// Rays against the image of a graph camera: cut by all frusta into straight pieces, which are walked near to far. The frusta
// are the rows of a texture, from the left: three columns of the matrix that takes a point relative to the centre to (u q, v q,
// q), the first with the number of planes behind it; the centre, relative to the anchor, and w q; then the planes, outward and
// with the distance from the centre.
#import "impostor/ray.wgsl"

const FRUSTUM_PLANES_AT = 4;
// What a row has room for; `impostor::FRUSTUM_TEXELS` less the four before.
const FRUSTUM_PLANE_CAP = 36;
// The most frusta that one ray is followed through.
const GRAPH_PIECE_CAP = 64;
// Two pieces meet if shares of the ray differ by no more: some roundings of numbers up to 1. It is 34 times 2^-24, and depths of four roundings each, their difference and its
// quotient make some ten. Along a plane shares are off by more: there depths are small against the places that they are differences of.
const SHARE_ROUNDING = 2e-6;

// A piece of a ray: shares of its length, from > to where there is none, and the frustum.
struct GraphPiece {
    start: f32,
    end: f32,
    frustum: i32,
}

fn frustum_piece(frusta: texture_2d<f32>, frustum: i32, a_anchor: vec3f, b_anchor: vec3f) -> GraphPiece {
    let centre = textureLoad(frusta, vec2i(3, frustum), 0).xyz;
    let planes = min(i32(textureLoad(frusta, vec2i(0, frustum), 0).w), FRUSTUM_PLANE_CAP);
    let a = a_anchor - centre;
    let b = b_anchor - centre;
    var piece = GraphPiece(0.0, 1.0, frustum);
    for (var index = 0; index < FRUSTUM_PLANE_CAP; index++) {
        if index >= planes {
            break;
        }
        let plane = textureLoad(frusta, vec2i(FRUSTUM_PLANES_AT + index, frustum), 0);
        let depth_a = plane.w - dot(plane.xyz, a);
        let depth_b = plane.w - dot(plane.xyz, b);
        if depth_a < 0.0 && depth_b < 0.0 {
            return GraphPiece(1.0, 0.0, frustum);
        } else if depth_a < 0.0 {
            piece.start = max(piece.start, depth_a / (depth_a - depth_b));
        } else if depth_b < 0.0 {
            piece.end = min(piece.end, depth_a / (depth_a - depth_b));
        }
    }
    return piece;
}

// The first piece that ends behind a share of the ray.
fn graph_piece_behind(frusta: texture_2d<f32>, share: f32, a_anchor: vec3f, b_anchor: vec3f) -> GraphPiece {
    let count = i32(textureDimensions(frusta).y);
    var first = GraphPiece(2.0, 0.0, 0);
    for (var frustum = 0; frustum < count; frustum++) {
        let piece = frustum_piece(frusta, frustum, a_anchor, b_anchor);
        if piece.start < piece.end && piece.end > share && piece.start < first.start {
            first = piece;
        }
    }
    return first;
}

fn frustum_image(frusta: texture_2d<f32>, frustum: i32, p_anchor: vec3f) -> vec3f {
    let centre_and_scale = textureLoad(frusta, vec2i(3, frustum), 0);
    let offset = p_anchor - centre_and_scale.xyz;
    let q = textureLoad(frusta, vec2i(0, frustum), 0).xyz * offset.x
        + textureLoad(frusta, vec2i(1, frustum), 0).xyz * offset.y
        + textureLoad(frusta, vec2i(2, frustum), 0).xyz * offset.z;
    return vec3f(q.xy, centre_and_scale.w) / q.z;
}

fn impostor_hit_of_graph(
    impostor: Impostor,
    frusta: texture_2d<f32>,
    texels: texture_2d<f32>,
    ranges: texture_2d<f32>,
    ray: ImpostorRay,
) -> ImpostorHit {
    let clipped = ray_clip(impostor, ray);
    if !(clipped.t_from <= clipped.t_to) {
        return impostor_miss(0u);
    }
    let a = ray_at(clipped, clipped.t_from);
    let b = ray_at(clipped, clipped.t_to);
    var steps = 0u;
    var piece = graph_piece_behind(frusta, 0.0, a, b);
    for (var index = 0; index < GRAPH_PIECE_CAP; index++) {
        if piece.start >= piece.end {
            break;
        }
        let next = graph_piece_behind(frusta, piece.end, a, b);
        let goes_on_at = select(1.0, next.start, next.start < next.end);
        let first = frustum_image(frusta, piece.frustum, mix(a, b, piece.start));
        let last = frustum_image(frusta, piece.frustum, mix(a, b, piece.end));
        let t_first = mix(clipped.t_from, clipped.t_to, piece.start);
        let t_last = mix(clipped.t_from, clipped.t_to, piece.end);
        let ends_open = goes_on_at > piece.end + SHARE_ROUNDING;
        let is_there = first.z > 0.0 && last.z > 0.0;
        let curve = ImpostorCurve(first.xy, first.z, t_first, last.xy, last.z, t_last, is_there, ends_open);
        var hit = impostor_walk(impostor, texels, ranges, curve_clip(impostor, curve));
        steps += hit.steps;
        if hit.side != IMPOSTOR_MISS {
            hit.steps = steps;
            return hit;
        }
        piece = next;
    }
    return impostor_miss(steps);
}
