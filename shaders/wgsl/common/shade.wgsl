// The look, as `protocol::Lighting` states it: shown = sRGB(1 - exp(-c)) with
// c = emissive + base * (ambient + sum of E * n.l * f / pi), where E is a light's irradiance on a facing surface and f is 1
// (Lambert) or Burley's diffuse factor. The light pass of the client and the truth renderer both call `shade_lit`.
// All vectors have the world's axes; positions are relative to the output eye.
#import "common/srgb.wgsl"

const MAX_LIGHTS: u32 = 16u;
const LIGHT_DIRECTIONAL: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const MATERIAL_UNLIT: u32 = 1u;
const MATERIAL_DOUBLE_SIDED: u32 = 2u;

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
    lights: array<Light, MAX_LIGHTS>,
}

struct Material {
    emissive: vec3f,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    ior: f32,
    flags: u32,
}

// The diffuse factor of Burley, Physically-Based Shading at Disney, 2012, §5.3, at roughness 1.
fn burley_factor(n_l: f32, n_v: f32, l_h: f32) -> f32 {
    let fd90 = 0.5 + 2.0 * l_h * l_h;
    return (1.0 + (fd90 - 1.0) * pow(1.0 - n_l, 5.0)) * (1.0 + (fd90 - 1.0) * pow(1.0 - n_v, 5.0));
}

// The share of a spot's intensity that leaves along `direction` (unit length, away from the light): KHR_lights_punctual.
fn spot_share(light: Light, direction: vec3f) -> f32 {
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
    // A centimetre keeps a surface at the light finite.
    let squared = max(dot(offset, offset), 1e-4);
    let to_light = offset * inverseSqrt(squared);
    let reach = squared * light.inverse_range * light.inverse_range;
    let window = clamp(1.0 - reach * reach, 0.0, 1.0);
    return Arriving(to_light, light.colour * (spot_share(light, -to_light) * window / squared));
}

// What one light adds to `c` per unit of base colour, seen from the output eye.
fn diffuse_light(light: Light, burley: u32, normal: vec3f, position: vec3f) -> vec3f {
    return diffuse_light_towards(light, burley, normal, position, -normalize(position));
}

// The same, seen from where the unit vector `to_eye` points.
fn diffuse_light_towards(light: Light, burley: u32, normal: vec3f, position: vec3f, to_eye: vec3f) -> vec3f {
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

// From exposed light to the sRGB-encoded picture.
fn shown_from_light(c: vec3f) -> vec3f {
    return srgb_from_linear(1.0 - exp(-c));
}

// The light that shows as a linear colour: the inverse of the exposure. What is whiter than SHOWN_MAX, which an 8-bit picture does
// not tell from white, counts as that, as no light shows as white itself.
const SHOWN_MAX = 0.9990234375;

fn light_from_shown(linear: vec3f) -> vec3f {
    return -log(1.0 - min(linear, vec3f(SHOWN_MAX)));
}

// The sRGB-encoded colour of a surface point. `base_linear` is linear RGB; `light` is what arrives: the ambient light plus
// `diffuse_light` of each light. The caller sums over its own uniform, because passing all lights by value would copy them
// for every fragment:
//
//     var light = lighting.ambient;
//     for (var index = 0u; index < lighting.light_count; index++) {
//         light += diffuse_light(lighting.lights[index], lighting.burley, normal, position);
//     }
fn shade_lit(base_linear: vec3f, light: vec3f, material: Material) -> vec3f {
    if (material.flags & MATERIAL_UNLIT) != 0u {
        return srgb_from_linear(base_linear);
    }
    return shown_from_light(material.emissive + base_linear * light);
}
