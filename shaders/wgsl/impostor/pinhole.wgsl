// Rays against the image of a pinhole or a single-pole camera: they differ by the push alone.
#import "camera/pinhole.wgsl"
#import "impostor/ray.wgsl"

// The projection of a finite ray, as far as it lies behind the near plane.
fn curve_of_pinhole(camera: Pinhole, ray: ImpostorRay) -> ImpostorCurve {
    var a = pinhole_eye_from_anchor(camera, ray_at(ray, ray.t_from));
    var b = pinhole_eye_from_anchor(camera, ray_at(ray, ray.t_to));
    let near_share = (camera.near_m - a.z) / (b.z - a.z);
    let t_near = mix(ray.t_from, ray.t_to, near_share);
    let near = vec3f(mix(a.xy, b.xy, near_share), camera.near_m);
    var t = vec2f(ray.t_from, ray.t_to);
    let is_there = max(a.z, b.z) >= camera.near_m;
    if a.z < camera.near_m {
        a = near;
        t.x = t_near;
    } else if b.z < camera.near_m {
        b = near;
        t.y = t_near;
    }
    let first = pinhole_image_from_eye(camera, a);
    let last = pinhole_image_from_eye(camera, b);
    return ImpostorCurve(first.xy, first.z, t.x, last.xy, last.z, t.y, is_there, false);
}

fn impostor_hit_of_pinhole(
    impostor: Impostor,
    camera: Pinhole,
    texels: texture_2d<f32>,
    ranges: texture_2d<f32>,
    ray: ImpostorRay,
) -> ImpostorHit {
    let clipped = ray_clip(impostor, ray);
    if !(clipped.t_from <= clipped.t_to) {
        return impostor_miss(0u);
    }
    return impostor_walk(impostor, texels, ranges, curve_clip(impostor, curve_of_pinhole(camera, clipped)));
}
