// From how much of each lamp is hidden to how much of its light arrives: see `client::shadow`.
#import "client/fullscreen.wgsl"

struct Lamps {
    // 1 in the channels of lamps, else 0.
    channels: vec4f,
    // All points, for each that was drawn so far.
    all_of_drawn: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

@group(0) @binding(0) var<uniform> lamps: Lamps;
@group(0) @binding(1) var hidden: texture_2d<f32>;

@fragment
fn seen(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return lamps.channels * (1.0 - lamps.all_of_drawn * textureLoad(hidden, vec2i(position.xy), 0));
}
