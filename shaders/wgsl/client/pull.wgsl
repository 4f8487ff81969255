// One level of the fill pyramid, from the one before.
#import "client/fullscreen.wgsl"
#import "client/pull_level.wgsl"

@group(0) @binding(0) var colour: texture_2d<f32>;
@group(0) @binding(1) var w_open: texture_2d<f32>;

@fragment
fn pull(@builtin(position) position: vec4f) -> Level {
    let base = 2 * vec2i(position.xy);
    let last = vec2i(textureDimensions(colour)) - 1;
    var colours: array<vec4f, 4>;
    var depths: array<vec2f, 4>;
    for (var i = 0; i < 4; i++) {
        let texel = min(base + vec2i(i & 1, i >> 1u), last);
        colours[i] = textureLoad(colour, texel, 0);
        depths[i] = textureLoad(w_open, texel, 0).xy;
    }
    return level_of(colours, depths);
}
