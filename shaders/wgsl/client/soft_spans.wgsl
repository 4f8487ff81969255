// The spans of inverse depth that surfaces have over 4 x 4 texels of an image, and over as many of those: see `client::soft::march`.
#import "client/fullscreen.wgsl"

// Planes, or spans; a layer an image.
@group(0) @binding(0) var finer: texture_2d_array<f32>;
// In x. Not a view of that layer alone: WebGL2 samples the whole texture through any view.
@group(0) @binding(1) var<uniform> layer: vec4u;

// The twin of the constant of `client::soft::march`.
const COARSER: i32 = 4;
// No ray meets it: its least is more than any w, and a number, as an f32 goes up to 3.4e38.
const NOTHING = vec2f(3e38, 0.0);

fn plane_span(texel: vec2i) -> vec2f {
    let plane = textureLoad(finer, texel, layer.x, 0);
    let half = 0.5 * (abs(plane.y) + abs(plane.z));
    return select(vec2f(plane.x - half, plane.x + half), NOTHING, plane.x == 0.0);
}

@fragment
fn widen_planes(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(finer)) - 1;
    var wide = NOTHING;
    for (var y = 0; y < COARSER; y++) {
        for (var x = 0; x < COARSER; x++) {
            let span = plane_span(min(COARSER * vec2i(position.xy) + vec2i(x, y), last));
            wide = vec2f(min(wide.x, span.x), max(wide.y, span.y));
        }
    }
    return vec4f(wide, 0.0, 0.0);
}

@fragment
fn widen_spans(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(finer)) - 1;
    var wide = NOTHING;
    for (var y = 0; y < COARSER; y++) {
        for (var x = 0; x < COARSER; x++) {
            let span = textureLoad(finer, min(COARSER * vec2i(position.xy) + vec2i(x, y), last), layer.x, 0).xy;
            wide = vec2f(min(wide.x, span.x), max(wide.y, span.y));
        }
    }
    return vec4f(wide, 0.0, 0.0);
}
