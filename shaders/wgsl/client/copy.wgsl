// A picture as it is.
#import "client/fullscreen.wgsl"

@group(0) @binding(0) var picture: texture_2d<f32>;

@fragment
fn copy(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return textureLoad(picture, vec2i(position.xy), 0);
}
