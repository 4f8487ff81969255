// Rays in the impostor of a graph camera.
#import "impostor/graph.wgsl"
#import "client/reflect/meet.wgsl"

@group(0) @binding(8) var frusta: texture_2d<f32>;

fn search(whole: ImpostorRay) -> ImpostorHit {
    var leg = whole;
    var steps = 0u;
    for (var index = 0; index < WALK_LEGS; index++) {
        var hit = impostor_hit_of_graph(image, frusta, planes, ranges, leg);
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
        found = met_on(captured_ray(ray), pixel, ray);
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
