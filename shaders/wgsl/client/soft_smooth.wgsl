// How much of each lamp is hidden, averaged over the pixels around that show the same surface and differ by little: see `client::soft::smooth`.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"

struct Smooth {
    // From a pixel to those it is averaged with.
    stride_px: i32,
    // What differs by as much does not count.
    widest: f32,
    padding_0: f32,
    padding_1: f32,
}

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> smoothing: Smooth;
@group(0) @binding(2) var w: texture_2d<f32>;
@group(0) @binding(3) var normal_ids: texture_2d<u32>;
@group(0) @binding(4) var hidden: texture_2d<f32>;

// Cosine of the angle by which normals on one surface may differ: 37 degrees.
const SAME_COSINE: f32 = 0.8;
// How steeply a neighbour may stand above or below the tangent plane: the tangent of 27 degrees.
const SAME_SLOPE: f32 = 0.5;

// In eye space; w is 0 where there is none.
fn point_at(pixel: vec2i) -> vec4f {
    let inverse_depth = textureLoad(w, pixel, 0).x;
    if inverse_depth == 0.0 {
        return vec4f(0.0);
    }
    return vec4f(pinhole_eye_from_image(camera, vec2f(pixel) + 0.5, inverse_depth), 1.0);
}

fn normal_at(pixel: vec2i) -> vec3f {
    return camera.eye_from_world * octahedral_normal_fine(textureLoad(normal_ids, pixel, 0).x);
}

@fragment
fn smooth_hidden(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let point = point_at(pixel);
    let own = textureLoad(hidden, pixel, 0);
    if point.w == 0.0 {
        return own;
    }
    let normal = normal_at(pixel);
    let size = vec2i(textureDimensions(w));
    var sum = vec4f(0.0);
    var weights = vec4f(0.0);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let beside = pixel + smoothing.stride_px * vec2i(x, y);
            if any(beside < vec2i(0)) || any(beside >= size) {
                continue;
            }
            let other = point_at(beside);
            let way = other.xyz - point.xyz;
            let is_same = other.w > 0.0 && dot(normal_at(beside), normal) > SAME_COSINE
                && abs(dot(way, normal)) <= SAME_SLOPE * length(way);
            if is_same {
                let value = textureLoad(hidden, beside, 0);
                let tent = f32((2 - abs(x)) * (2 - abs(y)));
                let weight = tent * max(1.0 - abs(value - own) / smoothing.widest, vec4f(0.0));
                sum += weight * value;
                weights += weight;
            }
        }
    }
    // It is one of them.
    return sum / weights;
}
