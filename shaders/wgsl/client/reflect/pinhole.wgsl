// Rays in the impostor of a pinhole or a single-pole camera.
#import "client/reflect/direction.wgsl"
#import "client/reflect/meet.wgsl"

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
    var found = MET_NOTHING;
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
    return kept(found);
}

@fragment
fn guide(@builtin(position) position: vec4f) -> Walked {
    return met_by_guide(vec2i(position.xy));
}

@fragment
fn walk_guided(in: Guided) -> Walked {
    return met_where_guided(in);
}

@fragment
fn count(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return steps_of(vec2i(position.xy));
}

@fragment
fn count_guide(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return steps_of(guide_pixel(vec2i(position.xy)));
}

@fragment
fn count_guided(in: Guided) -> @location(0) vec4f {
    return steps_where_guided(in);
}
