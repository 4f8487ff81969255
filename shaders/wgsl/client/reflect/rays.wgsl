// The rays that mirrors and glass in the picture send out. Without Fresnel: a mirror sends all light on and glass lets all
// of it in, each times its base colour.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "client/reflect/ray.wgsl"
#import "client/reflect/reflector.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> round: Round;
@group(0) @binding(2) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(3) var colour: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
@group(0) @binding(5) var w: texture_2d<f32>;
// Of `composite.wgsl`.
@group(0) @binding(6) var edges: texture_2d<f32>;

// Normals are rounded, and triangles interpolate them: a mirror doubles what they leap by and shows it as facets. Averages over pixels
// around tell the surface from the rounding.
const NORMAL_REACH_PX = 2;
// Cosine of how far a normal may turn within the reach: 15 degrees, 30 times as much as rounding does. Beyond, there is an edge.
const NORMAL_TURN_COS = 0.966;

// Sine of 15 degrees: see `facing_normal`.
const GRAZING_SIN = 0.26;

// The normal in a pixel, `offset_px` from its centre, as the pixels around have it: the mean of pairs on opposite sides, which what
// bends evenly does not shift, and how it changes from pixel to pixel by least squares over them.
fn steadied_normal(pixel: vec2i, ids: vec2u, offset_px: vec2f) -> vec3f {
    let own = octahedral_normal_fine(ids.x);
    var sum = own;
    // What differences add up to, times steps to the right and down; and the sums of these steps' products.
    var right = vec3f(0.0);
    var down = vec3f(0.0);
    var products = vec3f(0.0);
    for (var y = 0; y <= NORMAL_REACH_PX; y++) {
        for (var x = -NORMAL_REACH_PX; x <= NORMAL_REACH_PX; x++) {
            // One of each pair.
            if y == 0 && x <= 0 {
                continue;
            }
            let a = textureLoad(normal_ids, pixel + vec2i(x, y), 0).xy;
            let b = textureLoad(normal_ids, pixel - vec2i(x, y), 0).xy;
            if a.y != ids.y || b.y != ids.y {
                continue;
            }
            let normal_a = octahedral_normal_fine(a.x);
            let normal_b = octahedral_normal_fine(b.x);
            if min(dot(normal_a, own), dot(normal_b, own)) >= NORMAL_TURN_COS {
                sum += normal_a + normal_b;
                let step = vec2f(f32(x), f32(y));
                right += (normal_a - normal_b) * step.x;
                down += (normal_a - normal_b) * step.y;
                products += 2.0 * vec3f(step.x * step.x, step.y * step.y, step.x * step.y);
            }
        }
    }
    // Steps are whole numbers: 0 where all of them lie on a line, which says nothing of the other direction.
    let determinant = products.x * products.y - products.z * products.z;
    if determinant == 0.0 {
        return normalize(sum);
    }
    let of_right = (products.y * offset_px.x - products.z * offset_px.y) / determinant;
    let of_down = (products.x * offset_px.y - products.z * offset_px.x) / determinant;
    return normalize(normalize(sum) + of_right * right + of_down * down);
}

// A normal on the side that light arrives from. At outlines interpolated and rounded normals turn away a little: there light passes
// along the surface. What turns away by more is the other side of a sheet.
fn facing_normal(normal: vec3f, arriving: vec3f) -> vec3f {
    let away = dot(normal, arriving);
    if away > GRAZING_SIN {
        return -normal;
    }
    return normalize(normal - max(away, 0.0) * arriving);
}

fn ray_of_pixel(position: vec2f) -> PixelRay {
    let pixel = vec2i(position);
    let base = textureLoad(colour, pixel, 0);
    var ray = ray_without_reflector();
    if base.a == 0.0 {
        return ray;
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let code = (ids.y >> 16u) & 0xffu;
    let material = material_table[code];
    ray.origin = pinhole_eye_from_image(camera, position + round.offset_px, textureLoad(w, pixel, 0).x) * camera.eye_from_world;
    ray.throughput = linear_from_srgb(base.rgb);
    ray.object = (ids.y & 0xffffu) + 1u;
    ray.bounces = round.bounces;
    let arriving = normalize(ray.origin);
    if !(is_mirror(material) || is_glass(material)) {
        return ray;
    }
    let normal = facing_normal(steadied_normal(pixel, ids, round.offset_px), arriving);
    if is_mirror(material) {
        ray.state = RAY_OUTSIDE;
        ray.bounces -= 1u;
        ray.direction = reflect(arriving, normal);
    } else if is_glass(material) {
        ray.state = RAY_INSIDE;
        ray.material = code;
        ray.direction = refract(arriving, normal, 1.0 / max(material.ior, 1.0));
    }
    return ray;
}

@fragment
fn rays(@builtin(position) position: vec4f) -> RayTexels {
    return ray_texels(ray_of_pixel(position.xy));
}

// Only where edges are.
@fragment
fn rays_at_edges(@builtin(position) position: vec4f) -> RayTexels {
    if textureLoad(edges, vec2i(position.xy), 0).r == 0.0 {
        return ray_texels(ray_without_reflector());
    }
    return ray_texels(ray_of_pixel(position.xy));
}
