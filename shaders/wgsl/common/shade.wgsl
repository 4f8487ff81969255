// The look, as `protocol::Lighting` states it: shown = sRGB(tone(c)). Where no sky shines it is plain,
// c = emissive + base * (ambient + sum of E * n.l * f / pi), where E is a light's irradiance on a facing surface and f is 1
// (Lambert) or Burley's diffuse factor; under a sky it is full (`common/full.wgsl`). The client and the
// truth renderer both call `light_off` and `shown_off` of `common/surface_light.wgsl`.
// All vectors have the world's axes; positions are relative to the output eye.
#import "common/srgb.wgsl"
#import "common/tone.wgsl"

const MAX_LIGHTS: u32 = 16u;
const LIGHT_DIRECTIONAL: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const SKY_HARMONICS: u32 = 9u;
const MATERIAL_UNLIT: u32 = 1u;
const MATERIAL_DOUBLE_SIDED: u32 = 2u;
const MATERIAL_THIN: u32 = 4u;
// Rays bring what it mirrors.
const MATERIAL_ROUGH_MIRROR: u32 = 8u;

struct Light {
    // Relative to the output eye; unused by a directional light.
    position: vec3f,
    kind: u32,
    // Irradiance (directional) or radiant intensity (point).
    colour: vec3f,
    // 1 / range in 1/m; 0 where unlimited.
    inverse_range: f32,
    // The way the light travels or the spot points, unit length.
    direction: vec3f,
    // Cosines of a spot's inner and outer half angle.
    spot_cos_inner: f32,
    spot_cos_outer: f32,
    // 1 and the channel of the picture that says where the light arrives; 0 where it arrives everywhere.
    shadow: u32,
    padding_0: f32,
    padding_1: f32,
}

struct Lighting {
    ambient: vec3f,
    light_count: u32,
    // sRGB-encoded, 0 to 1.
    background: vec3f,
    // 1: Burley's diffuse term at roughness 1, on steep faces only.
    burley: u32,
    // What a matte white surface shows of the sky: harmonics, as `protocol::sky::harmonics` has them.
    sky_diffuse: array<vec4f, SKY_HARMONICS>,
    // What the light of the sky is multiplied by; 0 where none shines.
    sky: f32,
    // The first level that the sky's picture holds.
    sky_first_level: u32,
    tone: u32,
    // What all light is multiplied by before the tone.
    exposure: f32,
    // How much of what hides ambient light, and single lights, counts.
    occlusion_strength: f32,
    shadow_strength: f32,
    padding_0: f32,
    padding_1: f32,
    lights: array<Light, MAX_LIGHTS>,
}

struct Material {
    emissive: vec3f,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    ior: f32,
    // MATERIAL_*; from bit 8 on eight bits a channel, the roots of what is mirrored of light that falls straight on.
    flags: u32,
    // The share of light from all around that arrives.
    occlusion: f32,
    // What is mirrored of light that grazes.
    grazing: f32,
    clearcoat: f32,
    clearcoat_roughness: f32,
    sheen: vec3f,
    sheen_roughness: f32,
}

// The diffuse factor of Burley, Physically-Based Shading at Disney, 2012, §5.3, at roughness 1.
fn burley_factor(n_l: f32, n_v: f32, l_h: f32) -> f32 {
    let fd90 = 0.5 + 2.0 * l_h * l_h;
    return (1.0 + (fd90 - 1.0) * pow(1.0 - n_l, 5.0)) * (1.0 + (fd90 - 1.0) * pow(1.0 - n_v, 5.0));
}

// The share of a spot's intensity that leaves along `direction` (unit length, away from the light): KHR_lights_punctual.
fn spot_share(light: Light, direction: vec3f) -> f32 {
    // Not 0 where the two are equal. A tenth of the 0.001 that the extension's text has, and far above the 6e-8 by which cosines near 1 round. A spot whose half angle is less
    // than 0.8 degrees gets dimmer by it.
    let span = max(light.spot_cos_inner - light.spot_cos_outer, 1e-4);
    let share = clamp((dot(direction, light.direction) - light.spot_cos_outer) / span, 0.0, 1.0);
    return share * share;
}

struct Arriving {
    // Unit vector towards the light.
    to_light: vec3f,
    irradiance: vec3f,
}

fn arriving_light(light: Light, position: vec3f) -> Arriving {
    if light.kind == LIGHT_DIRECTIONAL {
        return Arriving(-light.direction, light.colour);
    }
    let offset = light.position - position;
    // A centimetre keeps a surface at the light finite. Chosen, and the same in scenes of any size: nearer than that the way to the light is no unit vector, and its light fades.
    // At a tenth of it what a lamp touches is a hundred times as bright, at ten times what is within a decimetre fades.
    let squared = max(dot(offset, offset), 1e-4);
    let to_light = offset * inverseSqrt(squared);
    let reach = squared * light.inverse_range * light.inverse_range;
    let window = clamp(1.0 - reach * reach, 0.0, 1.0);
    return Arriving(to_light, light.colour * (spot_share(light, -to_light) * window / squared));
}

// The light that a light makes a matte white surface show, seen from where the unit vector `to_eye` points.
fn diffuse_light(light: Light, burley: u32, normal: vec3f, position: vec3f, to_eye: vec3f) -> vec3f {
    let arriving = arriving_light(light, position);
    let n_l = dot(normal, arriving.to_light);
    if n_l <= 0.0 {
        return vec3f(0.0);
    }
    var factor = n_l * 0.3183098862;
    if burley != 0u {
        // The flat look's light reaches steep faces only.
        if n_l >= 0.5 {
            return vec3f(0.0);
        }
        let half_way = normalize(arriving.to_light + to_eye);
        let l_h = clamp(dot(arriving.to_light, half_way), 0.0, 1.0);
        factor *= burley_factor(n_l, clamp(dot(normal, to_eye), 0.0, 1.0), l_h);
    }
    return arriving.irradiance * factor;
}
