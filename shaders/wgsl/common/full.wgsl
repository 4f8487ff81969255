// The full look: materials of glTF 2.0 (appendix B) under a sky.
#import "common/sky.wgsl"

const PI = 3.14159265359;
// Squares of roughness below this make highlights narrower than a pixel, and divide by nearly nothing.
const LEAST_ALPHA = 0.0025;

struct Lobes {
    // Linear RGB: what is scattered, and what is mirrored of light that falls straight on.
    diffuse: vec3f,
    straight: vec3f,
    roughness: f32,
}

fn lobes_of(base: vec3f, material: Material) -> Lobes {
    let ratio = (material.ior - 1.0) / (material.ior + 1.0);
    let straight = mix(vec3f(ratio * ratio), base, material.metallic);
    return Lobes(base * (1.0 - material.metallic), straight, material.roughness);
}

// The GGX lobe (Walter and others, 2007) with the correlated Smith masking (Heitz 2014) and Schlick's Fresnel, times the light's cosine.
fn mirrored_of_lamp(lobes: Lobes, n_l: f32, n_v: f32, n_h: f32, l_h: f32) -> vec3f {
    let alpha = max(lobes.roughness * lobes.roughness, LEAST_ALPHA);
    let squared = alpha * alpha;
    let narrow = n_h * n_h * (squared - 1.0) + 1.0;
    let spread = squared / (PI * narrow * narrow);
    let masked = n_l * sqrt(n_v * n_v * (1.0 - squared) + squared) + n_v * sqrt(n_l * n_l * (1.0 - squared) + squared);
    let fresnel = lobes.straight + (1.0 - lobes.straight) * pow(1.0 - l_h, 5.0);
    return fresnel * (n_l * spread * 0.5 / max(masked, 1e-6));
}

// What leaves of a lamp's light towards `to_eye`: diffuse and mirrored.
fn light_of_lamp(light: Light, lobes: Lobes, normal: vec3f, position: vec3f, to_eye: vec3f) -> vec3f {
    let arriving = arriving_light(light, position);
    let n_l = dot(normal, arriving.to_light);
    if n_l <= 0.0 {
        return vec3f(0.0);
    }
    let half_way = normalize(arriving.to_light + to_eye);
    let n_v = max(dot(normal, to_eye), 1e-4);
    let l_h = clamp(dot(arriving.to_light, half_way), 0.0, 1.0);
    let mirrored = mirrored_of_lamp(lobes, n_l, n_v, clamp(dot(normal, half_way), 0.0, 1.0), l_h);
    return arriving.irradiance * (lobes.diffuse * (n_l / PI) + mirrored);
}

// What leaves of the sky's light. How much a lobe mirrors of even light is Karis' fit (*Physically based shading on mobile*, 2014); light that
// leaves after several bounces within the surface is added as Fdez-Aguera does (*A multiple-scattering microfacet model*, 2019).
fn light_of_sky(lobes: Lobes, normal: vec3f, to_eye: vec3f) -> vec3f {
    let n_v = clamp(dot(normal, to_eye), 0.0, 1.0);
    let fit = lobes.roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let bend = min(fit.x * fit.x, exp2(-9.28 * n_v)) * fit.x + fit.y;
    let ab = vec2f(-1.04, 1.04) * bend + fit.zw;
    let once = lobes.straight * ab.x + ab.y;
    let lost = 1.0 - (ab.x + ab.y);
    let mean = lobes.straight + (1.0 - lobes.straight) / 21.0;
    let again = once * mean / (1.0 - lost * mean) * lost;
    let even = sky_diffuse(normal);
    let mirrored = sky_mirrored(reflect(-to_eye, normal), lobes.roughness);
    let left = 1.0 - max(max(once.r + again.r, once.g + again.g), once.b + again.b);
    return once * mirrored + (again + lobes.diffuse * left) * even;
}
