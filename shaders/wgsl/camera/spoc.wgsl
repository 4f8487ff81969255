// The push of the single-pole occlusion camera: the twin of `camera::Spoc`, whose pinhole stands beside it.
#import "camera/pinhole.wgsl"

struct Push {
    pole_px: vec2f,
    // Depths along the optical axis, and their inverses.
    from_m: f32,
    to_m: f32,
    from_w: f32,
    to_w: f32,
    max_px: f32,
    ramp_px: f32,
}

// How far the push grows per inverse depth.
fn push_rate(push: Push) -> f32 {
    return push.max_px / (push.from_w - push.to_w);
}

// How far a point at a depth is pushed outside of the ramp; before the push begins, and behind the eye, not at all.
fn push_px(push: Push, z_m: f32) -> f32 {
    if z_m <= push.from_m {
        return 0.0;
    }
    return clamp(push_rate(push) * (push.from_w - 1.0 / z_m), 0.0, push.max_px);
}

// Where the pinhole sees a point, from the pole, times its depth: linear in the point.
fn straight_px_m(camera: Pinhole, push: Push, p_eye: vec3f) -> vec2f {
    return camera.focal_px * p_eye.xy + (camera.centre_px - push.pole_px) * p_eye.z;
}

// As `pinhole_clip_from_eye`, which it is up to where the push begins: so what reaches before the near plane is clipped
// as ever.
fn spoc_clip_from_eye(camera: Pinhole, push: Push, p_eye: vec3f) -> vec4f {
    let pushed_by_px = push_px(push, p_eye.z);
    var pushed_px_m = straight_px_m(camera, push, p_eye);
    if pushed_by_px > 0.0 {
        pushed_px_m *= 1.0 + pushed_by_px / max(length(pushed_px_m) / p_eye.z, push.ramp_px);
    }
    let image_px_m = 2.0 * (pushed_px_m + push.pole_px * p_eye.z) / camera.size_px;
    return vec4f(image_px_m.x - p_eye.z, p_eye.z - image_px_m.y, camera.near_m, p_eye.z);
}
