// Rays in the impostor of a pinhole or a single-pole camera.
#import "client/reflect/direction.wgsl"

// What is shown for lack of a crossing lies behind every crossing, however far: up to 1e9 m.
const FOR_LACK = 1e-9;

fn search(whole: ImpostorRay) -> ImpostorHit {
    var leg = whole;
    var steps = 0u;
    for (var index = 0; index < WALK_LEGS; index++) {
        var hit = impostor_hit_of_pinhole(image, camera, planes, ranges, leg);
        steps += hit.steps;
        if hit.side == IMPOSTOR_MISS {
            break;
        } else if is_met(hit) {
            hit.steps = steps;
            return hit;
        }
        leg = leg_behind(leg, hit);
    }
    return impostor_miss(steps);
}

@fragment
fn walk(@builtin(position) position: vec4f) -> Walked {
    let pixel = vec2i(position.xy);
    let ray = walked_ray(pixel);
    var found = Walked(vec4u(0u), 0.0);
    // Not by discarding first: some rasterizers go on with the rest then, and only drop what comes of it.
    if looks_here(ray) {
        var hit = search(captured_ray(ray));
        var nearness = 1.0;
        if hit.side == IMPOSTOR_MISS && placed.kind == PLACED_ENVIRONMENT {
            // It passed behind an edge, where the camera does not see: what is shown beside the edge is nearer to the truth than nothing.
            let leg = captured_ray(ray);
            hit = look_up(ray_at(leg, placed.middle_m / length(leg.direction)));
            nearness = FOR_LACK;
        }
        if hit.side != IMPOSTOR_MISS {
            found = walked(pixel, ray, hit);
            found.depth *= nearness;
        }
    }
    if found.depth <= 0.0 {
        discard;
    }
    return found;
}

// Of one ray of the low resolution.
@fragment
fn guide(@builtin(position) position: vec4f) -> Walked {
    let ray = walked_ray(guide_pixel(vec2i(position.xy)));
    var found = Walked(vec4u(0u), 0.0);
    if looks_here(ray) {
        let hit = search(captured_ray(ray));
        if hit.side != IMPOSTOR_MISS {
            found = guided_by(hit);
        }
    }
    if found.depth <= 0.0 {
        discard;
    }
    return found;
}

// Where rays of the low resolution say.
@fragment
fn walk_guided(in: Guided) -> Walked {
    let pixel = vec2i(in.position.xy);
    let ray = walked_ray(pixel);
    var found = Walked(vec4u(0u), 0.0);
    let hit = search(guided_ray(ray, in.range_m));
    if hit.side != IMPOSTOR_MISS {
        found = walked(pixel, ray, hit);
    }
    if found.depth <= 0.0 {
        discard;
    }
    return found;
}

// (stretches and steps, rays)
@fragment
fn count(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let ray = walked_ray(vec2i(position.xy));
    if !looks_here(ray) {
        discard;
    }
    return vec4f(f32(search(captured_ray(ray)).steps), 1.0, 0.0, 0.0);
}

@fragment
fn count_guide(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let ray = walked_ray(guide_pixel(vec2i(position.xy)));
    if !looks_here(ray) {
        discard;
    }
    return vec4f(f32(search(captured_ray(ray)).steps), 1.0, 0.0, 0.0);
}

@fragment
fn count_guided(in: Guided) -> @location(0) vec4f {
    let ray = walked_ray(vec2i(in.position.xy));
    return vec4f(f32(search(guided_ray(ray, in.range_m)).steps), 1.0, 0.0, 0.0);
}
