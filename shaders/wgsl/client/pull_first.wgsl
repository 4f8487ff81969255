// The first level of the fill pyramid, from the lit picture: it finds borders, and what surfaces say of them.
#import "client/fullscreen.wgsl"
#import "client/pull_level.wgsl"

@group(0) @binding(0) var colour: texture_2d<f32>;
@group(0) @binding(1) var w: texture_2d<f32>;
@group(0) @binding(2) var normal_ids: texture_2d<u32>;

// Where a surface turns away from the eye nothing tells that it is seen to end, so an end that is told weighs more. (FLIP over covered
// pixels in a fast orbit of the built-in tree: 0.1024 with equal weights, 0.1017 with these, 0.1014 without any filling.)
const END_WEIGHT: f32 = 3.0;
// Triangles as they are end there, which says little of what lies behind: where a surface of samples goes on beside them, they do not keep it off.
const EXACT_WEIGHT: f32 = 0.25;

// 1 where the surface goes on beside what is not covered, below zero where it ends there, 0 within it.
fn open_at(texel: vec2i, last: vec2i) -> f32 {
    var nearby = 1.0;
    for (var i = 0; i < 4; i++) {
        let way = select(vec2i(0, 2 * (i >> 1u) - 1), vec2i(2 * (i >> 1u) - 1, 0), (i & 1) == 0);
        nearby = min(nearby, textureLoad(colour, clamp(texel + way, vec2i(0), last), 0).a);
    }
    let ids = textureLoad(normal_ids, texel, 0).y;
    let ends = (ids >> 31u) != 0u;
    let is_exact = ((ids >> 30u) & 1u) != 0u;
    return select(0.0, select(select(1.0, -EXACT_WEIGHT, is_exact), -END_WEIGHT, ends), nearby == 0.0);
}

@fragment
fn pull_first(@builtin(position) position: vec4f) -> Level {
    let base = 2 * vec2i(position.xy);
    let last = vec2i(textureDimensions(colour)) - 1;
    var colours: array<vec4f, 4>;
    var depths: array<vec2f, 4>;
    for (var i = 0; i < 4; i++) {
        let texel = min(base + vec2i(i & 1, i >> 1u), last);
        colours[i] = textureLoad(colour, texel, 0);
        depths[i] = vec2f(textureLoad(w, texel, 0).x, open_at(texel, last));
    }
    return level_of(colours, depths);
}
