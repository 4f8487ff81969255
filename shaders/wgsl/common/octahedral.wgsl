// Octahedral unit vectors, 8 + 8 bits: the twin of `protocol::image::octahedral_code` and `octahedral_normal`.
// The 16-bit code holds the first coordinate in its low byte.

fn octahedral_fold(p: vec2f) -> vec2f {
    return (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
}

fn octahedral_code(normal: vec3f) -> u32 {
    let sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    if !(sum > 0.0) {
        return 127u | (127u << 8u);
    }
    var p = normal.xy / sum;
    if normal.z < 0.0 {
        p = octahedral_fold(p);
    }
    let q = vec2u(clamp(floor((p + 1.0) * 127.0 + 0.5), vec2f(0.0), vec2f(254.0)));
    return q.x | (q.y << 8u);
}

fn octahedral_normal(code: u32) -> vec3f {
    let q = vec2f(f32(code & 0xffu), f32((code >> 8u) & 0xffu));
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
