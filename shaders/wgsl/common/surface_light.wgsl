// The light that leaves a surface towards the eye, and how it is shown: by the look that both ends share, plain or full. Whoever imports this
// declares `lighting` and `sky`, see `common/sky.wgsl`.
#import "common/full.wgsl"

// A surface point that is seen from somewhere.
struct Seen {
    // Linear RGB.
    base: vec3f,
    // Unit length, world axes.
    normal: vec3f,
    // Relative to what the lights' positions are relative to.
    position: vec3f,
    // Unit vector.
    to_eye: vec3f,
    // The share of the light from all around that arrives.
    ambient_share: f32,
    // In the channels that the lights name, the shares of theirs.
    light_share: vec4f,
}

// Whether the look may be full: where it is known not to be, nothing is left of it.
override may_be_full: bool = true;

fn is_full() -> bool {
    return may_be_full && lighting.sky > 0.0;
}

fn light_off(seen: Seen, material: Material) -> vec3f {
    if (material.flags & MATERIAL_UNLIT) != 0u {
        if is_full() {
            return seen.base;
        }
        return light_from_shown(seen.base, lighting.tone) / lighting.exposure;
    }
    let lobes = lobes_of(seen.base, material);
    // Of a plain surface what arrives, of a full one what leaves.
    let ambient_share = seen.ambient_share * material.occlusion;
    var light = ambient_share * lighting.ambient;
    if is_full() {
        light = light_of_sky(lobes, seen.normal, seen.to_eye, ambient_share);
    }
    for (var index = 0u; index < lighting.light_count; index++) {
        let lamp = lighting.lights[index];
        var of_lamp = vec3f(0.0);
        if is_full() {
            of_lamp = light_of_lamp(lamp, lobes, seen.normal, seen.position, seen.to_eye);
        } else {
            of_lamp = diffuse_light(lamp, lighting.burley, seen.normal, seen.position, seen.to_eye);
        }
        if lamp.shadow != 0u {
            of_lamp *= seen.light_share[lamp.shadow - 1u];
        }
        light += of_lamp;
    }
    return material.emissive + select(seen.base * (1.0 - passing_of(material)) * light, light, is_full());
}

// The share of the light from straight behind that passes, linear RGB: of a pane, what it does not mirror, tinted by its base colour.
fn light_through(seen: Seen, material: Material) -> vec3f {
    let passing = passing_of(material) * (1.0 - material.metallic);
    if passing == 0.0 || !is_full() {
        return passing * seen.base;
    }
    let lobes = lobes_of(seen.base, material);
    let mirrored = bounced(lobes.straight, lobes.grazing, mirrored_even(lobes.roughness, clamp(dot(seen.normal, seen.to_eye), 0.0, 1.0)));
    return passing * (1.0 - most_of(mirrored.once + mirrored.again)) * seen.base;
}

// The sRGB-encoded picture of it. Without light, a base colour is shown as it is.
fn shown_off(seen: Seen, material: Material) -> vec3f {
    if (material.flags & MATERIAL_UNLIT) != 0u && !is_full() {
        return srgb_from_linear(seen.base);
    }
    return shown_from_light(lighting.exposure * light_off(seen, material), lighting.tone);
}
