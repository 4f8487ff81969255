// The rays that mirrors and glass in the picture send out. In the plain look without Fresnel: a mirror sends all light on and glass lets all
// of it in, each times its base colour. In the full look mirrors whiten where light grazes, and glass mirrors the sky by as much as it lets in less.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/surface_light.wgsl"
#import "client/reflect/lobe.wgsl"
#import "client/reflect/ray.wgsl"
#import "client/reflect/reflector.wgsl"

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> round: Round;
@group(0) @binding(2) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(3) var colour: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
@group(0) @binding(5) var w: texture_2d<f32>;
@group(0) @binding(6) var<uniform> lighting: Lighting;
@group(0) @binding(7) var sky: texture_2d<f32>;
// Of `composite.wgsl`.
@group(0) @binding(8) var edges: texture_2d<f32>;

// Sine of 15 degrees: see `facing_normal`.
const GRAZING_SIN = 0.26;

// How a normal changes by a step of a pixel, as neighbours on both sides have it; nothing where an edge lies between.
fn normal_change(pixel: vec2i, step: vec2i, ids: vec2u, own: vec3f) -> vec3f {
    let a = textureLoad(normal_ids, pixel + step, 0).xy;
    let b = textureLoad(normal_ids, pixel - step, 0).xy;
    let normal_a = octahedral_normal_fine(a.x);
    let normal_b = octahedral_normal_fine(b.x);
    let is_smooth = min(dot(normal_a, own), dot(normal_b, own)) >= NORMAL_TURN_COS;
    // Of one object and one material, whatever else is said of them.
    let others = ((a.y ^ ids.y) | (b.y ^ ids.y)) & 0xffffffu;
    return select(vec3f(0.0), (normal_a - normal_b) * 0.5, is_smooth && others == 0u);
}

// The normal `offset_px` beside a pixel's centre. At the centre it is the pixel's own: an average over neighbours would be steadier, but
// flatter than what bends, and a mirror doubles that.
fn normal_beside(pixel: vec2i, ids: vec2u, offset_px: vec2f) -> vec3f {
    let own = octahedral_normal_fine(ids.x);
    if all(offset_px == vec2f(0.0)) {
        return own;
    }
    let right = normal_change(pixel, vec2i(1, 0), ids, own);
    let down = normal_change(pixel, vec2i(0, 1), ids, own);
    return normalize(own + right * offset_px.x + down * offset_px.y);
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
    if !(is_mirror(material) || is_glass(material) || is_rough_mirror(material)) {
        return ray;
    }
    let normal = facing_normal(normal_beside(pixel, ids, round.offset_px), arriving);
    let rise = pow(1.0 - clamp(dot(normal, -arriving), 0.0, 1.0), 5.0);
    if is_mirror(material) {
        if is_full() {
            ray.throughput = mix(ray.throughput, vec3f(1.0), rise);
        }
        ray.state = RAY_OUTSIDE;
        ray.bounces -= 1u;
        ray.direction = reflect(arriving, normal);
    } else if is_rough_mirror(material) {
        ray.state = RAY_OUTSIDE;
        ray.bounces = 0u;
        ray.lobe = material.roughness * material.roughness;
        // What it brings is averaged with what its neighbours' rays do; how much of that is mirrored, the pixel says.
        ray.throughput = vec3f(1.0);
        ray.direction = lobe_direction(normal, -arriving, ray.lobe, lobe_point(pixel));
    } else if is_glass(material) {
        ray.state = RAY_INSIDE;
        ray.material = code;
        ray.through = 1u;
        if is_full() {
            let lobes = lobes_of(ray.throughput, material);
            let mirrored = mix(lobes.straight, vec3f(lobes.grazing), rise);
            ray.light = mirrored * sky_mirrored(reflect(arriving, normal), material.roughness);
            ray.throughput *= 1.0 - mirrored;
        }
        ray.direction = refract(arriving, normal, 1.0 / max(material.ior, 1.0));
    }
    return ray;
}

@fragment
fn rays(@builtin(position) position: vec4f) -> RayTexels {
    return ray_texels(ray_of_pixel(position.xy));
}

// Only where edges are; a rough mirror shows none.
@fragment
fn rays_at_edges(@builtin(position) position: vec4f) -> RayTexels {
    let ray = ray_of_pixel(position.xy);
    if textureLoad(edges, vec2i(position.xy), 0).r == 0.0 || ray.lobe > 0.0 {
        return ray_texels(ray_without_reflector());
    }
    return ray_texels(ray);
}
