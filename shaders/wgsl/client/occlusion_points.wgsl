// The view's own z-buffer as points: what `surface/points.wgsl` draws for a graph camera. Relative to the output eye, world axes.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var w: texture_2d<f32>;

@fragment
fn points(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let inverse_depth = textureLoad(w, vec2i(position.xy), 0).x;
    if inverse_depth == 0.0 {
        return vec4f(0.0);
    }
    // The rotation's inverse is its transpose.
    return vec4f(pinhole_eye_from_image(camera, position.xy, inverse_depth) * camera.eye_from_world, 1.0);
}
