// What rays do where they have met something, or nothing: they go on, or bring its light.
#import "client/fullscreen.wgsl"
#import "common/surface_light.wgsl"
#import "client/reflect/found.wgsl"
#import "client/reflect/ray.wgsl"
#import "client/reflect/reflector.wgsl"

@group(0) @binding(0) var<uniform> round: Round;
@group(0) @binding(1) var<uniform> lighting: Lighting;
@group(0) @binding(2) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(3) var first: texture_2d<u32>;
@group(0) @binding(4) var second: texture_2d<u32>;
@group(0) @binding(5) var met: texture_2d<u32>;
@group(0) @binding(6) var sky: texture_2d<f32>;

// Less of a ray than a twentieth of a step of an 8-bit picture's darkest part, 1/(12.92 * 255), is not followed.
const LEAST_THROUGHPUT = 1.5e-5;

// A roughness whose lobe is as wide as that of a surface and of the rays that meet it. One of a few rays meets a patch as wide as its share of the lobe, over
// which normals turn by as much where the surface bends as much as it is near: light that leaves it turns twice as far. Three times the lobe, by eye: with twice,
// a lamp's picture on a pot still shows as squares in a tray.
fn widened(roughness: f32, lobe: f32) -> f32 {
    let alpha = roughness * roughness;
    return min(sqrt(sqrt(alpha * alpha + 9.0 * lobe * lobe)), 1.0);
}

fn surface_light(found: Found, of_surface: Material, position: vec3f, direction: vec3f, lobe: f32) -> vec3f {
    var material = of_surface;
    material.roughness = widened(material.roughness, lobe);
    material.clearcoat_roughness = widened(material.clearcoat_roughness, lobe);
    var normal = found.normal;
    if (material.flags & MATERIAL_DOUBLE_SIDED) != 0u && dot(normal, direction) > 0.0 {
        normal = -normal;
    }
    let base = linear_from_srgb(found.colour);
    return light_off(Seen(base, normal, position, -direction, 1.0, vec4f(1.0)), material);
}

// How far a ray's direction is from those of the pixels on two sides, of the nearer one: beyond an edge lies something else.
fn turn(ray: PixelRay, pixel: vec2i, step: vec2i) -> f32 {
    var least = 2.0;
    for (var side = -1; side <= 1; side += 2) {
        let at = clamp(pixel + side * step, vec2i(0), vec2i(textureDimensions(first)) - 1);
        let other = ray_from_texels(textureLoad(first, at, 0), textureLoad(second, at, 0));
        if other.state == ray.state && any(at != pixel) {
            least = min(least, distance(other.direction, ray.direction));
        }
    }
    return select(least, 0.0, least == 2.0);
}

// The roughness whose lobe is about as wide as what a pixel shows: a box as wide as the turn to the next pixel has a standard deviation of 0.29 of it, and a
// lobe of about its alpha.
fn spread_roughness(ray: PixelRay, pixel: vec2i) -> f32 {
    if ray.lobe > 0.0 {
        // One of a few rays of a lobe: narrower than that, and wide enough that they meet.
        return sqrt(ray.lobe / 3.0);
    }
    return sqrt(0.29 * max(turn(ray, pixel, vec2i(1, 0)), turn(ray, pixel, vec2i(0, 1))));
}

// The ray ends before the background, or in the sky where one shines and no glass was passed.
fn in_background(ray: PixelRay, roughness: f32) -> PixelRay {
    var done = ray;
    if is_full() && ray.through == 0u {
        done.light += ray.throughput * sky_mirrored(ray.direction, roughness);
    } else {
        let shown = linear_from_srgb(lighting.background);
        done.light += ray.throughput * light_from_shown(shown, lighting.tone) / lighting.exposure;
    }
    done.state = RAY_DONE;
    return done;
}

fn through_glass(ray: PixelRay, normal: vec3f, position: vec3f) -> PixelRay {
    var next = ray;
    next.origin = position;
    let facing = select(normal, -normal, dot(normal, ray.direction) > 0.0);
    let leaving = refract(ray.direction, facing, max(material_table[ray.material].ior, 1.0));
    if dot(leaving, leaving) > 0.0 {
        next.state = RAY_OUTSIDE;
        next.direction = leaving;
    } else {
        next.direction = reflect(ray.direction, facing);
    }
    return next;
}

fn off_surface(ray: PixelRay, found: Found, position: vec3f) -> PixelRay {
    var next = ray;
    next.origin = position;
    next.object = found.object;
    let material = material_table[found.material];
    if is_mirror(material) && ray.bounces > 0u && round.is_last == 0u {
        next.bounces -= 1u;
        next.direction = reflect(ray.direction, found.normal);
        next.throughput *= linear_from_srgb(found.colour);
        return next;
    }
    next.light += ray.throughput * found.weight * surface_light(found, material, position, ray.direction, ray.lobe);
    next.throughput *= 1.0 - found.weight;
    if all(next.throughput < vec3f(LEAST_THROUGHPUT)) {
        next.state = RAY_DONE;
    }
    return next;
}

fn ray_after(ray: PixelRay, found: Found, pixel: vec2i) -> PixelRay {
    if !ray_is_followed(ray) {
        return ray;
    }
    let position = ray.origin + ray.direction * found.t;
    var next = ray;
    if found.weight > 0.0 && ray.state == RAY_INSIDE {
        next = through_glass(ray, found.normal, position);
    } else if found.weight > 0.0 {
        next = off_surface(ray, found, position);
    } else if ray.state == RAY_INSIDE && round.is_last == 0u {
        // Nobody has shown where the glass ends there: it goes straight on.
        next.state = RAY_OUTSIDE;
    } else {
        return in_background(ray, spread_roughness(ray, pixel));
    }
    if ray_is_followed(next) && round.is_last != 0u {
        return in_background(next, spread_roughness(ray, pixel));
    }
    return next;
}

@fragment
fn bounce(@builtin(position) position: vec4f) -> RayTexels {
    let pixel = vec2i(position.xy);
    let ray = ray_from_texels(textureLoad(first, pixel, 0), textureLoad(second, pixel, 0));
    return ray_texels(ray_after(ray, found_from_texel(textureLoad(met, pixel, 0)), pixel));
}
