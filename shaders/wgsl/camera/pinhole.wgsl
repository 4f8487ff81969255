// The pinhole camera: the twin of `camera::Pinhole`. Eye space is x right, y down, z forward; w = 1/z.

struct Pinhole {
    // Rotates the world's axes into eye space.
    eye_from_world: mat3x3f,
    // The eye relative to the anchor that positions are relative to, metres, world axes.
    eye_anchor: vec3f,
    near_m: f32,
    centre_px: vec2f,
    size_px: vec2f,
    focal_px: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

fn pinhole_eye_from_anchor(camera: Pinhole, p_anchor: vec3f) -> vec3f {
    return camera.eye_from_world * (p_anchor - camera.eye_anchor);
}

// The ray (x', y', 1) of an image point.
fn pinhole_ray(camera: Pinhole, image_px: vec2f) -> vec3f {
    return vec3f((image_px - camera.centre_px) / camera.focal_px, 1.0);
}

// (u, v, w); the point must lie in front of the eye.
fn pinhole_image_from_eye(camera: Pinhole, p_eye: vec3f) -> vec3f {
    let w = 1.0 / p_eye.z;
    return vec3f(camera.centre_px + camera.focal_px * w * p_eye.xy, w);
}

fn pinhole_eye_from_image(camera: Pinhole, image_px: vec2f, w: f32) -> vec3f {
    return pinhole_ray(camera, image_px) / w;
}

// Reversed, infinite depth: depth = near * w, nearer is larger.
fn pinhole_clip_from_eye(camera: Pinhole, p_eye: vec3f) -> vec4f {
    let scale = vec2f(2.0, -2.0) * camera.focal_px / camera.size_px;
    let shift = vec2f(2.0, -2.0) * camera.centre_px / camera.size_px + vec2f(-1.0, 1.0);
    return vec4f(scale * p_eye.xy + shift * p_eye.z, camera.near_m, p_eye.z);
}
