// What a ray meets in one impostor, and in how many steps, for the entry points of its kind of camera. Whoever imports this declares
// `search`, the first crossing that counts on a ray.
#import "client/reflect/walk.wgsl"

const MET_NOTHING = Walked(vec4u(0u), 0.0);

// Of a pixel's ray, or of a leg of it.
fn met_on(leg: ImpostorRay, pixel: vec2i, ray: PixelRay) -> Walked {
    let hit = search(leg);
    if hit.side == IMPOSTOR_MISS {
        return MET_NOTHING;
    }
    return walked(pixel, ray, hit);
}

// Of one ray of the low resolution.
fn met_by_guide(place: vec2i) -> Walked {
    let ray = walked_ray(guide_pixel(place));
    var found = MET_NOTHING;
    if looks_here(ray) {
        let hit = search(captured_ray(ray));
        if hit.side != IMPOSTOR_MISS {
            found = guided_by(hit);
        }
    }
    return kept(found);
}

// Where rays of the low resolution say.
fn met_where_guided(in: Guided) -> Walked {
    let pixel = vec2i(in.position.xy);
    let ray = walked_ray(pixel);
    return kept(met_on(guided_ray(ray, in.range_m), pixel, ray));
}

// What was met, where anything was. Not by discarding first: some rasterizers go on with the rest then, and only drop what comes of it.
fn kept(found: Walked) -> Walked {
    if found.depth <= 0.0 {
        discard;
    }
    return found;
}

// (stretches and steps, rays)
fn steps_of(pixel: vec2i) -> vec4f {
    let ray = walked_ray(pixel);
    if !looks_here(ray) {
        discard;
    }
    return vec4f(f32(search(captured_ray(ray)).steps), 1.0, 0.0, 0.0);
}

fn steps_where_guided(in: Guided) -> vec4f {
    let ray = walked_ray(vec2i(in.position.xy));
    return vec4f(f32(search(guided_ray(ray, in.range_m)).steps), 1.0, 0.0, 0.0);
}
