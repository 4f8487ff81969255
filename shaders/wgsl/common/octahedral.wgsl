// Octahedral unit vectors, 8 + 8 bits, and what these leave off, 4 + 4 bits: the twins of `protocol::image::octahedral_code`,
// `octahedral_rest` and `octahedral_normal_with_rest`. The 16-bit code holds the first coordinate in its low byte.

fn octahedral_fold(p: vec2f) -> vec2f {
    return (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
}

// Coordinates from -1 to 1; 0 of a vector without direction.
fn octahedral(normal: vec3f) -> vec2f {
    let sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    if !(sum > 0.0) {
        return vec2f(0.0);
    }
    let p = normal.xy / sum;
    if normal.z < 0.0 {
        return octahedral_fold(p);
    }
    return p;
}

fn octahedral_steps(p: vec2f) -> vec2f {
    return clamp(floor((p + 1.0) * 127.0 + 0.5), vec2f(0.0), vec2f(254.0));
}

fn octahedral_code(normal: vec3f) -> u32 {
    let q = vec2u(octahedral_steps(octahedral(normal)));
    return q.x | (q.y << 8u);
}

fn octahedral_rest(normal: vec3f) -> u32 {
    let p = octahedral(normal);
    let steps = clamp(floor((p + 1.0) * 2032.0 + 0.5) - 16.0 * octahedral_steps(p), vec2f(-8.0), vec2f(7.0));
    let q = bitcast<vec2u>(vec2i(steps)) & vec2u(15u);
    return q.x | (q.y << 4u);
}

fn octahedral_normal(code: u32) -> vec3f {
    return octahedral_normal_with_rest(code, 0u);
}

fn octahedral_normal_with_rest(code: u32, rest: u32) -> vec3f {
    // Of four bits each, the sign spread upwards.
    let steps = (vec2i(vec2u(rest, rest >> 4u) << vec2u(28u)) >> vec2u(28u));
    let q = vec2f(f32(code & 0xffu), f32((code >> 8u) & 0xffu)) + vec2f(steps) / 16.0;
    var p = q / 127.0 - 1.0;
    let z = 1.0 - abs(p.x) - abs(p.y);
    if z < 0.0 {
        p = octahedral_fold(p);
    }
    let n = vec3f(p, z);
    let squared = dot(n, n);
    if squared > 0.0 {
        return n * inverseSqrt(squared);
    }
    return vec3f(0.0, 0.0, 1.0);
}

// 16 + 16 bits, for normals that are interpolated; the first coordinate in the low half.
fn octahedral_code_fine(normal: vec3f) -> u32 {
    let sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    if !(sum > 0.0) {
        return pack2x16snorm(vec2f(0.0));
    }
    var p = normal.xy / sum;
    if normal.z < 0.0 {
        p = octahedral_fold(p);
    }
    return pack2x16snorm(p);
}

fn octahedral_normal_fine(code: u32) -> vec3f {
    var p = unpack2x16snorm(code);
    let z = 1.0 - abs(p.x) - abs(p.y);
    if z < 0.0 {
        p = octahedral_fold(p);
    }
    return normalize(vec3f(p, z));
}
