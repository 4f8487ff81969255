// What a ray has met, in 16 bytes.
#import "common/octahedral.wgsl"

struct Found {
    // The ray's parameter, metres.
    t: f32,
    // In world space now, unit length, to the side that the samples show.
    normal: vec3f,
    // sRGB-encoded base colour.
    colour: vec3f,
    // Material code.
    material: u32,
    // One more than the object that was met; 0 for none.
    object: u32,
    // How much of it is there; above 0, unless nothing was met.
    weight: f32,
}

// t's bits; the normal's code; colour and, from bit 24, material; the object and, from bit 24, the weight.
fn found_texel(found: Found) -> vec4u {
    // Not pack4x8unorm, which GLSL ES 3.00 lacks.
    let colour = vec3u(clamp(found.colour, vec3f(0.0), vec3f(1.0)) * 255.0 + 0.5);
    let weight = max(u32(found.weight * 255.0 + 0.5), 1u);
    return vec4u(
        bitcast<u32>(found.t),
        octahedral_code_fine(found.normal),
        colour.x | (colour.y << 8u) | (colour.z << 16u) | (found.material << 24u),
        found.object | (weight << 24u),
    );
}

fn found_from_texel(texel: vec4u) -> Found {
    return Found(
        bitcast<f32>(texel.x),
        octahedral_normal_fine(texel.y),
        vec3f((vec3u(texel.z) >> vec3u(0u, 8u, 16u)) & vec3u(0xffu)) / 255.0,
        texel.z >> 24u,
        texel.w & 0xffffffu,
        f32(texel.w >> 24u) / 255.0,
    );
}
