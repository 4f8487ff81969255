// Adds the light that rays have brought to what reflectors show, where some of them are rough: a sum of colours, and of rays.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "client/reflect/lobe.wgsl"
#import "client/reflect/ray.wgsl"
#import "client/reflect/reflector.wgsl"
#import "common/surface_light.wgsl"

@group(0) @binding(0) var first: texture_2d<u32>;
@group(0) @binding(1) var second: texture_2d<u32>;
@group(0) @binding(2) var<uniform> lighting: Lighting;
@group(0) @binding(3) var<uniform> camera: Pinhole;
@group(0) @binding(4) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(5) var colour: texture_2d<f32>;
@group(0) @binding(6) var normal_ids: texture_2d<u32>;
// As shown, without what rays bring.
@group(0) @binding(7) var lit: texture_2d<f32>;
@group(0) @binding(8) var sky: texture_2d<f32>;

const GATHER_SIDE = 2 * LOBE_SIDE - 1;

fn ray_at(pixel: vec2i) -> PixelRay {
    return ray_from_texels(textureLoad(first, pixel, 0), textureLoad(second, pixel, 0));
}

// The mean of what the rays of a lobe bring: this pixel's and those around it on the same object, by weights that fall to 0 four
// pixels away, and that are as much in sum for each of the sixteen rays.
fn arriving_around(pixel: vec2i, ids: vec2u) -> vec3f {
    let normal = octahedral_normal_fine(ids.x);
    let last = vec2i(textureDimensions(first)) - 1;
    var sum = vec4f(0.0);
    for (var index = 0; index < GATHER_SIDE * GATHER_SIDE; index++) {
        let step = vec2i(index % GATHER_SIDE, index / GATHER_SIDE) - GATHER_SIDE / 2;
        let at = pixel + step;
        let inside = clamp(at, vec2i(0), last);
        let other = ray_at(inside);
        let other_ids = textureLoad(normal_ids, inside, 0).xy;
        let is_beside = all(at == inside) && other.lobe > 0.0 && ((other_ids.y ^ ids.y) & 0xffffu) == 0u;
        if is_beside && dot(octahedral_normal_fine(other_ids.x), normal) >= NORMAL_TURN_COS {
            let weight = (LOBE_SIDE - abs(step.x)) * (LOBE_SIDE - abs(step.y));
            sum += vec4f(other.light, 1.0) * f32(weight);
        }
    }
    return sum.rgb / max(sum.a, 1.0);
}

// Linear colours as shown.
@fragment
fn gather_rough(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let ray = ray_at(pixel);
    if ray.state == RAY_NONE {
        discard;
    }
    if ray.lobe == 0.0 {
        return vec4f(toned(lighting.exposure * ray.light, lighting.tone), 1.0);
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let material = material_table[(ids.y >> 16u) & 0xffu];
    let to_eye = -normalize(pinhole_eye_from_image(camera, position.xy, 1.0) * camera.eye_from_world);
    let n_v = abs(dot(octahedral_normal_fine(ids.x), to_eye));
    let lobes = lobes_of(linear_from_srgb(textureLoad(colour, pixel, 0).rgb), material);
    let mirrored = mirrored_once(lobes, n_v) * arriving_around(pixel, ids);
    let own = light_from_shown(linear_from_srgb(textureLoad(lit, pixel, 0).rgb), lighting.tone);
    return vec4f(toned(own + lighting.exposure * mirrored, lighting.tone), 1.0);
}
