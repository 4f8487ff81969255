// The full look: materials of glTF 2.0 (appendix B) under a sky, with its extensions of specular, clear coat and sheen.
#import "common/sky.wgsl"

const PI = 3.14159265359;
// Squares of roughness below this make highlights narrower than a pixel, and divide by nearly nothing: what is divided by is alpha^2 where a highlight is brightest, 6e-6
// here, and two roundings of numbers near 1 make it 1.2e-7 more or less. At a tenth of this they would be twice alpha^2.
const LEAST_ALPHA = 0.0025;
// Fibres' roughness below this makes a rim narrower than a pixel.
const LEAST_SHEEN_ROUGHNESS = 0.07;

struct Lobes {
    // A mix of a dielectric and a metal, by the metal's share. Linear RGB: what the dielectric scatters, and what either mirrors of light that falls
    // straight on.
    diffuse: vec3f,
    straight: vec3f,
    metal: vec3f,
    metallic: f32,
    // What the dielectric mirrors of light that grazes; a metal mirrors all.
    grazing: f32,
    roughness: f32,
    coat: f32,
    coat_roughness: f32,
    // Linear RGB.
    sheen: vec3f,
    sheen_roughness: f32,
    // Whether rays bring what it mirrors.
    by_rays: bool,
}

// The share of what its base colour lets leave that comes from behind: of a pane, which is no metal.
fn passing_of(material: Material) -> f32 {
    return select(0.0, material.transmission, (material.flags & MATERIAL_THIN) != 0u);
}

fn lobes_of(base: vec3f, material: Material) -> Lobes {
    let root = unpack4x8unorm(material.flags >> 8u).rgb;
    var lobes: Lobes;
    lobes.diffuse = base * (1.0 - passing_of(material));
    lobes.straight = root * root;
    lobes.metal = base;
    lobes.metallic = material.metallic;
    lobes.grazing = material.grazing;
    lobes.roughness = material.roughness;
    lobes.coat = material.clearcoat;
    lobes.coat_roughness = material.clearcoat_roughness;
    lobes.sheen = material.sheen;
    lobes.sheen_roughness = max(material.sheen_roughness, LEAST_SHEEN_ROUGHNESS);
    lobes.by_rays = (material.flags & MATERIAL_ROUGH_MIRROR) != 0u;
    return lobes;
}

fn most_of(c: vec3f) -> f32 {
    return max(max(c.r, c.g), c.b);
}

// Schlick's Fresnel of a coat, whose index of refraction is 1.5.
fn coat_fresnel(cosine: f32) -> f32 {
    return 0.04 + 0.96 * pow(1.0 - cosine, 5.0);
}

// The cosines at a surface that lamps light.
struct Cosines {
    n_l: f32,
    n_v: f32,
    n_h: f32,
    l_h: f32,
}

// The GGX lobe (Walter and others, 2007) with the correlated Smith masking (Heitz 2014), times the light's cosine.
fn ggx(roughness: f32, at: Cosines) -> f32 {
    let alpha = max(roughness * roughness, LEAST_ALPHA);
    let squared = alpha * alpha;
    let narrow = at.n_h * at.n_h * (squared - 1.0) + 1.0;
    let spread = squared / (PI * narrow * narrow);
    let masked = at.n_l * sqrt(at.n_v * at.n_v * (1.0 - squared) + squared) + at.n_v * sqrt(at.n_l * at.n_l * (1.0 - squared) + squared);
    // Never divides by 0. By the least cosine to the eye and the least alpha it is 2.5e-7 and more: 1e-6 is larger only where lamp and eye both graze the surface.
    return at.n_l * spread * 0.5 / max(masked, 1e-6);
}

// What fibres scatter: the spread of Estevez and Kulla (*Production friendly microfacet sheen BRDF*, 2017) with the masking of Neubelt and Pettineo (*Crafting
// a next-gen material pipeline for The Order: 1886*, 2013), times the light's cosine.
fn fibres(roughness: f32, at: Cosines) -> f32 {
    let inverse_alpha = 1.0 / (roughness * roughness);
    // Not 0, which has no logarithm to raise it to a power by. Of the roughest fibres, whose power is 1, a sine of 0.01 leaves a hundredth of the most, and less of others.
    let sine = sqrt(max(1.0 - at.n_h * at.n_h, 1e-4));
    let spread = (2.0 + inverse_alpha) * pow(sine, inverse_alpha) / (2.0 * PI);
    return at.n_l * spread / (4.0 * (at.n_l + at.n_v - at.n_l * at.n_v));
}

// How much of even light they scatter; the figures of the fit are those of three.js, 2026.
fn fibres_even(roughness: f32, n_v: f32) -> f32 {
    let squared = roughness * roughness;
    let inverse = 1.0 / (roughness + 0.1);
    let slope = -1.9362 + 1.0678 * roughness + 0.4573 * squared - 0.8469 * inverse;
    let offset = -0.6014 + 0.5538 * roughness - 0.4670 * squared - 0.1255 * inverse;
    return min(exp(slope * n_v + offset), 1.0);
}

// What leaves of a lamp's light towards `to_eye`.
fn light_of_lamp(light: Light, lobes: Lobes, normal: vec3f, position: vec3f, to_eye: vec3f) -> vec3f {
    let arriving = arriving_light(light, position);
    let n_l = dot(normal, arriving.to_light);
    if n_l <= 0.0 {
        return vec3f(0.0);
    }
    let half_way = normalize(arriving.to_light + to_eye);
    // Not 0, by which fibres and mirrors divide: at 1e-4 a metre of a surface, seen from a metre away, is a tenth of a millimetre wide.
    let n_v = clamp(dot(normal, to_eye), 1e-4, 1.0);
    let at = Cosines(n_l, n_v, clamp(dot(normal, half_way), 0.0, 1.0), clamp(dot(arriving.to_light, half_way), 0.0, 1.0));
    let rise = pow(1.0 - at.l_h, 5.0);
    let fresnel = mix(mix(lobes.straight, vec3f(lobes.grazing), rise), mix(lobes.metal, vec3f(1.0), rise), lobes.metallic);
    var leaving = lobes.diffuse * ((1.0 - lobes.metallic) * n_l / PI) + fresnel * ggx(lobes.roughness, at);
    if any(lobes.sheen > vec3f(0.0)) {
        leaving *= 1.0 - most_of(lobes.sheen) * fibres_even(lobes.sheen_roughness, n_v);
        leaving += lobes.sheen * fibres(lobes.sheen_roughness, at);
    }
    if lobes.coat > 0.0 {
        leaving *= 1.0 - lobes.coat * coat_fresnel(n_v);
        leaving += lobes.coat * coat_fresnel(at.l_h) * ggx(lobes.coat_roughness, at);
    }
    return arriving.irradiance * leaving;
}

// How much a lobe mirrors of even light after one bounce within the surface: of what falls straight on, and of what grazes. A fit of our own to the
// integral over the GGX lobe, 0.007 and 0.005 off in the mean of squares (the fit of Karis, *Physically based shading on mobile*, 2014, is 0.13 and
// 0.02 off that, as its masking is not the correlated one).
const LOST = mat4x4f(
    2.896, -14.993, 22.688, -10.729,
    -12.97, 80.384, -130.715, 64.848,
    16.865, -116.833, 203.74, -104.846,
    -6.557, 49.409, -90.52, 48.029,
);
const GRAZING = mat3x4f(
    -0.001, -1.253, -7.401, 5.744,
    -4.309, 16.858, -25.413, 7.691,
    -6.56, -18.405, 53.112, -30.075,
);

fn mirrored_even(roughness: f32, n_v: f32) -> vec2f {
    let r = vec4f(1.0, roughness, roughness * roughness, roughness * roughness * roughness);
    let root = sqrt(n_v);
    let lost = roughness * dot(r, LOST * vec4f(1.0, root, n_v, root * n_v));
    let grazing = exp(dot(r, GRAZING * vec3f(1.0, n_v, n_v * n_v)));
    return vec2f(1.0 - lost - grazing, grazing);
}

// What leaves of even light after one bounce within the surface and after several, as Fdez-Aguera has it (*A multiple-scattering microfacet model*, 2019).
struct Bounced {
    once: vec3f,
    again: vec3f,
}

fn bounced(straight: vec3f, grazing: f32, even: vec2f) -> Bounced {
    let once = straight * even.x + grazing * even.y;
    let lost = 1.0 - (even.x + even.y);
    let mean = straight + (1.0 - straight) / 21.0;
    return Bounced(once, once * mean / (1.0 - lost * mean) * lost);
}

// What arrives of the light around a mirrored direction, where a share of all light does: smooth surfaces mirror little of what is hidden (Lagarde and
// de Rousiers, *Moving Frostbite to physically based rendering*, 2014, 4.10.2).
fn mirrored_share(share: f32, n_v: f32, roughness: f32) -> f32 {
    return saturate(pow(n_v + share, exp2(-16.0 * roughness - 1.0)) - 1.0 + share);
}

// Of the even light around the mirrored direction, what leaves after one bounce within the surface.
fn mirrored_once(lobes: Lobes, n_v: f32) -> vec3f {
    let even = mirrored_even(lobes.roughness, n_v);
    let once = mix(bounced(lobes.straight, lobes.grazing, even).once, bounced(lobes.metal, 1.0, even).once, lobes.metallic);
    return once * (1.0 - most_of(lobes.sheen) * fibres_even(lobes.sheen_roughness, n_v)) * (1.0 - lobes.coat * coat_fresnel(n_v));
}

// What leaves of the sky's light, of which a share arrives. A rough surface mirrors rather what lies around its normal (Lagarde and de Rousiers, 4.9.3).
fn light_of_sky(lobes: Lobes, normal: vec3f, to_eye: vec3f, share: f32) -> vec3f {
    let n_v = clamp(dot(normal, to_eye), 0.0, 1.0);
    let mirror_way = reflect(-to_eye, normal);
    let alpha = lobes.roughness * lobes.roughness;
    let way = normalize(mix(mirror_way, normal, alpha * alpha));
    let of_even = mirrored_even(lobes.roughness, n_v);
    let dielectric = bounced(lobes.straight, lobes.grazing, of_even);
    let metal = bounced(lobes.metal, 1.0, of_even);
    let once = mix(dielectric.once, metal.once, lobes.metallic);
    let scattered = dielectric.again + lobes.diffuse * (1.0 - most_of(dielectric.once + dielectric.again));
    let even = share * sky_diffuse(normal);
    var mirrored = mirrored_share(share, n_v, lobes.roughness) * sky_mirrored(way, lobes.roughness);
    if lobes.by_rays {
        mirrored = vec3f(0.0);
    }
    var leaving = once * mirrored + mix(scattered, metal.again, lobes.metallic) * even;
    if any(lobes.sheen > vec3f(0.0)) {
        let by_fibres = fibres_even(lobes.sheen_roughness, n_v);
        leaving = leaving * (1.0 - most_of(lobes.sheen) * by_fibres) + lobes.sheen * by_fibres * even;
    }
    if lobes.coat > 0.0 {
        let coat = mirrored_even(lobes.coat_roughness, n_v);
        let of_coat = share * (0.04 * coat.x + coat.y) * sky_mirrored(mirror_way, lobes.coat_roughness);
        leaving = leaving * (1.0 - lobes.coat * coat_fresnel(n_v)) + lobes.coat * of_coat;
    }
    return leaving;
}
