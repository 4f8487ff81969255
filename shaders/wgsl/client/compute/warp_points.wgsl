// Some of a lamp's points, as eyes that look the same way from places beside a frame's: the twin of `client::soft::warp::PointsUniform`.
const WARP_POINTS: u32 = 32u;

struct WarpPoints {
    // Of each map.
    size_px: vec2u,
    // Texels from a row to the next.
    pitch: u32,
    // Invocations in a row of the dispatch.
    row: u32,
    point_count: u32,
    padding_1: u32,
    padding_2: u32,
    padding_3: u32,
    // By how much a point at w = 1 shifts in x and y; then the image's centre.
    places: array<vec4f, WARP_POINTS>,
    // What a hidden point counts.
    weights: array<vec4f, WARP_POINTS>,
}
