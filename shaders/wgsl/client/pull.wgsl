// One level of the fill pyramid: of up to four texels, the colour of the farther surface and the share that is covered.
// What a hole shows is most likely what the nearer surface beside it hid.
#import "client/fullscreen.wgsl"

@group(0) @binding(0) var colour: texture_2d<f32>;
@group(0) @binding(1) var w: texture_2d<f32>;

// Surfaces within this factor of the farthest count as the farther surface.
const SAME_SURFACE: f32 = 1.25;

struct Level {
    // sRGB-encoded colour (zero where nothing is covered), and the covered share.
    @location(0) colour: vec4f,
    // 1/z of the farther surface.
    @location(1) w: f32,
}

@fragment
fn pull(@builtin(position) position: vec4f) -> Level {
    let base = 2 * vec2i(position.xy);
    let last = vec2i(textureDimensions(colour)) - 1;
    var colours: array<vec4f, 4>;
    var depths: array<f32, 4>;
    var farthest = 3.4e38;
    var share = 0.0;
    for (var i = 0; i < 4; i++) {
        let texel = min(base + vec2i(i & 1, i >> 1u), last);
        colours[i] = textureLoad(colour, texel, 0);
        depths[i] = textureLoad(w, texel, 0).x;
        share += 0.25 * colours[i].a;
        if colours[i].a > 0.0 {
            farthest = min(farthest, depths[i]);
        }
    }
    var sum = vec4f(0.0);
    var depth = 0.0;
    for (var i = 0; i < 4; i++) {
        if colours[i].a > 0.0 && depths[i] <= SAME_SURFACE * farthest {
            sum += vec4f(colours[i].rgb, 1.0) * colours[i].a;
            depth += depths[i] * colours[i].a;
        }
    }
    if sum.a == 0.0 {
        return Level(vec4f(0.0), 0.0);
    }
    return Level(vec4f(sum.rgb / sum.a, share), depth / sum.a);
}
