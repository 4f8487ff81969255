// What is blended, over what lies behind it: of every pixel the layers from the nearest on, as far as no opaque surface hides them.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/srgb.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
// Inverse depth of the opaque surfaces, 1/m; 0 where there is none.
@group(0) @binding(1) var opaque_w: texture_2d<f32>;
// As `Lit`; a single texel of nothing where there are fewer layers.
@group(0) @binding(2) var colour_0: texture_2d<f32>;
@group(0) @binding(3) var w_0: texture_2d<f32>;
@group(0) @binding(4) var colour_1: texture_2d<f32>;
@group(0) @binding(5) var w_1: texture_2d<f32>;
@group(0) @binding(6) var colour_2: texture_2d<f32>;
@group(0) @binding(7) var w_2: texture_2d<f32>;
@group(0) @binding(8) var colour_3: texture_2d<f32>;
@group(0) @binding(9) var w_3: texture_2d<f32>;

// The twin of `protocol::Purpose::LAYERS`.
const LAYERS: u32 = 4u;

struct Sheet {
    // Linear light times what it hides, and that.
    over: vec4f,
    w: f32,
}

// What is behind the opaque surface by more than a pixel is wide there is hidden; nearer, it lies on it.
fn sheet(colour: texture_2d<f32>, w: texture_2d<f32>, pixel: vec2i, hidden_w: f32) -> Sheet {
    let shown = textureLoad(colour, pixel, 0);
    let own_w = textureLoad(w, pixel, 0).x;
    if shown.a == 0.0 || own_w < hidden_w {
        return Sheet(vec4f(0.0), 0.0);
    }
    return Sheet(vec4f(linear_from_srgb(shown.rgb) * shown.a, shown.a), own_w);
}

@fragment
fn blend(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let before = textureLoad(opaque_w, pixel, 0).x;
    // At the distance z a pixel is z / f wide.
    let hidden_w = before / (1.0 + 1.0 / camera.focal_px);
    var sheets = array<Sheet, LAYERS>(
        sheet(colour_0, w_0, pixel, hidden_w),
        sheet(colour_1, w_1, pixel, hidden_w),
        sheet(colour_2, w_2, pixel, hidden_w),
        sheet(colour_3, w_3, pixel, hidden_w),
    );
    var over = vec4f(0.0);
    // The nearest of those that are left, each time.
    for (var turn = 0u; turn < LAYERS; turn++) {
        var nearest = 0u;
        for (var other = 1u; other < LAYERS; other++) {
            if sheets[other].w > sheets[nearest].w {
                nearest = other;
            }
        }
        over += (1.0 - over.a) * sheets[nearest].over;
        sheets[nearest] = Sheet(vec4f(0.0), 0.0);
    }
    return over;
}
