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
    ray.origin = pinhole_eye_from_image(camera, position, textureLoad(w, pixel, 0).x) * camera.eye_from_world;
    ray.throughput = linear_from_srgb(base.rgb);
    ray.object = (ids.y & 0xffffu) + 1u;
    ray.bounces = round.bounces;
    let arriving = normalize(ray.origin);
    var normal = octahedral_normal_fine(ids.x);
    if dot(normal, arriving) > 0.0 {
        normal = -normal;
    }
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
