// The papers' baseline: an impostor as an environment map. Directions alone count, as if every ray began where the impostor's
// camera is and everything were as far away as its middle.
#import "impostor/pinhole.wgsl"
#import "client/reflect/walk.wgsl"

@group(0) @binding(8) var<uniform> camera: Pinhole;

fn look_up(ray: PixelRay) -> ImpostorHit {
    let direction = normalize(placed.capture_from_now * ray.direction);
    let p_eye = camera.eye_from_world * (direction * placed.middle_m);
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

@fragment
fn walk(@builtin(position) position: vec4f) -> Walked {
    let pixel = vec2i(position.xy);
    let ray = walked_ray(pixel);
    // Not by discarding first: some rasterizers go on with the rest then, and only drop what comes of it.
    if looks_here(ray) {
        let hit = look_up(ray);
        if hit.side != IMPOSTOR_MISS {
            return walked(pixel, ray, hit);
        }
    }
    discard;
}

// (look-ups, rays)
@fragment
fn count(@builtin(position) position: vec4f) -> @location(0) vec4f {
    if !looks_here(walked_ray(vec2i(position.xy))) {
        discard;
    }
    return vec4f(1.0, 1.0, 0.0, 0.0);
}
