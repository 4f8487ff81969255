// Rays, relative to the anchor: the twin of `impostor::Ray`.
#import "impostor/walk.wgsl"

struct ImpostorRay {
    origin_anchor: vec3f,
    t_from: f32,
    // Not zero.
    direction: vec3f,
    // Finite, or as large as a number gets.
    t_to: f32,
}

fn ray_at(ray: ImpostorRay, t: f32) -> vec3f {
    return ray.origin_anchor + ray.direction * t;
}

// The part within the impostor's bounds; without any, t_from > t_to.
fn ray_clip(impostor: Impostor, ray: ImpostorRay) -> ImpostorRay {
    let end = ray.origin_anchor + ray.direction;
    var t = vec2f(ray.t_from, ray.t_to);
    t = clip_linear(t, ray.origin_anchor.x, end.x, impostor.bounds_min_anchor.x, impostor.bounds_max_anchor.x);
    t = clip_linear(t, ray.origin_anchor.y, end.y, impostor.bounds_min_anchor.y, impostor.bounds_max_anchor.y);
    t = clip_linear(t, ray.origin_anchor.z, end.z, impostor.bounds_min_anchor.z, impostor.bounds_max_anchor.z);
    return ImpostorRay(ray.origin_anchor, t.x, ray.direction, t.y);
}
