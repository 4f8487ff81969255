// The sRGB transfer function, IEC 61966-2-1, per channel; both directions for 0 to 1.

fn srgb_from_linear(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

fn linear_from_srgb(encoded: vec3f) -> vec3f {
    let c = clamp(encoded, vec3f(0.0), vec3f(1.0));
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}
