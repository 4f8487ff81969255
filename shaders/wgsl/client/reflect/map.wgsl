// The papers' baseline: an impostor as an environment map. Directions alone count, as if every ray began where the impostor's
// camera is and everything were as far away as its middle.
#import "client/reflect/direction.wgsl"

@fragment
fn walk(@builtin(position) position: vec4f) -> Walked {
    let pixel = vec2i(position.xy);
    let ray = walked_ray(pixel);
    var found = Walked(vec4u(0u), 0.0);
    // Not by discarding first: some rasterizers go on with the rest then, and only drop what comes of it.
    if looks_here(ray) {
        let hit = look_up(normalize(placed.capture_from_now * ray.direction) * placed.middle_m);
        if hit.side != IMPOSTOR_MISS {
            found = walked(pixel, ray, hit);
        }
    }
    if found.depth <= 0.0 {
        discard;
    }
    return found;
}

// (look-ups, rays)
@fragment
fn count(@builtin(position) position: vec4f) -> @location(0) vec4f {
    if !looks_here(walked_ray(vec2i(position.xy))) {
        discard;
    }
    return vec4f(1.0, 1.0, 0.0, 0.0);
}
