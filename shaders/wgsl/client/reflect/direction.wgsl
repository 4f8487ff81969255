// What a pinhole's or a single-pole camera's impostor shows in a direction, without walking.
#import "impostor/pinhole.wgsl"
#import "client/reflect/walk.wgsl"

@group(0) @binding(8) var<uniform> camera: Pinhole;

// The sample that the camera holds in the direction of a point, at capture and relative to the anchor.
fn look_up(p_anchor: vec3f) -> ImpostorHit {
    let p_eye = pinhole_eye_from_anchor(camera, p_anchor);
    if p_eye.z < camera.near_m {
        return impostor_miss(0u);
    }
    let there = impostor_image_from_straight(image, pinhole_image_from_eye(camera, p_eye));
    let pixel = vec2i(floor(there.xy));
    let texel = impostor_texel(planes, pixel);
    if texel.x <= 0.0 {
        return impostor_miss(0u);
    }
    let distance_m = length(p_eye) / (p_eye.z * texel.x);
    return ImpostorHit(distance_m, IMPOSTOR_FRONT, pixel, vec3f(there.xy, texel.x), 1u);
}
