// What is seen through, over what lies behind it: of every pixel the layers from the nearest on, as far as no opaque surface hides them.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/srgb.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
// Inverse depth of the opaque surfaces, 1/m; 0 where there is none. As large as the layers, or a whole share of it.
@group(0) @binding(1) var opaque_w: texture_2d<f32>;
// As `LitLayer`; a single texel of nothing where there are fewer layers.
@group(0) @binding(2) var colour_0: texture_2d<f32>;
@group(0) @binding(3) var w_0: texture_2d<f32>;
@group(0) @binding(4) var through_0: texture_2d<f32>;
@group(0) @binding(5) var colour_1: texture_2d<f32>;
@group(0) @binding(6) var w_1: texture_2d<f32>;
@group(0) @binding(7) var through_1: texture_2d<f32>;
@group(0) @binding(8) var colour_2: texture_2d<f32>;
@group(0) @binding(9) var w_2: texture_2d<f32>;
@group(0) @binding(10) var through_2: texture_2d<f32>;
@group(0) @binding(11) var colour_3: texture_2d<f32>;
@group(0) @binding(12) var w_3: texture_2d<f32>;
@group(0) @binding(13) var through_3: texture_2d<f32>;

// The twin of `protocol::Purpose::LAYERS`.
const LAYERS: u32 = 4u;

struct Sheet {
    // Linear light of its own.
    light: vec3f,
    // The share of what lies behind that is seen.
    through: vec3f,
    w: f32,
}

fn nothing() -> Sheet {
    return Sheet(vec3f(0.0), vec3f(1.0), 0.0);
}

// What is behind the opaque surface by more than a pixel is wide there is hidden; nearer, it lies on it.
fn sheet(colour: texture_2d<f32>, w: texture_2d<f32>, through: texture_2d<f32>, pixel: vec2i, hidden_w: f32) -> Sheet {
    let shown = textureLoad(colour, pixel, 0);
    let own_w = textureLoad(w, pixel, 0).x;
    if shown.a == 0.0 || own_w < hidden_w {
        return nothing();
    }
    return Sheet(linear_from_srgb(shown.rgb), textureLoad(through, pixel, 0).rgb, own_w);
}

struct Over {
    // Linear light of all that is seen through; alpha 1 where anything is.
    @location(0) light: vec4f,
    // The share of what lies behind all of it that is seen.
    @location(1) through: vec4f,
}

@fragment
fn blend(@builtin(position) position: vec4f) -> Over {
    let pixel = vec2i(position.xy);
    let samples = vec2i(textureDimensions(colour_0) / textureDimensions(opaque_w));
    let before = textureLoad(opaque_w, pixel / samples, 0).x;
    // At the distance z a pixel is z / f wide.
    let hidden_w = before / (1.0 + 1.0 / camera.focal_px);
    var sheets = array<Sheet, LAYERS>(
        sheet(colour_0, w_0, through_0, pixel, hidden_w),
        sheet(colour_1, w_1, through_1, pixel, hidden_w),
        sheet(colour_2, w_2, through_2, pixel, hidden_w),
        sheet(colour_3, w_3, through_3, pixel, hidden_w),
    );
    var over = Over(vec4f(0.0), vec4f(1.0));
    // The nearest of those that are left, each time.
    for (var turn = 0u; turn < LAYERS; turn++) {
        var nearest = 0u;
        for (var other = 1u; other < LAYERS; other++) {
            if sheets[other].w > sheets[nearest].w {
                nearest = other;
            }
        }
        let is_there = sheets[nearest].w > 0.0;
        over.light = vec4f(over.light.rgb + over.through.rgb * sheets[nearest].light, select(over.light.a, 1.0, is_there));
        over.through = vec4f(over.through.rgb * sheets[nearest].through, 1.0);
        sheets[nearest] = nothing();
    }
    return over;
}
