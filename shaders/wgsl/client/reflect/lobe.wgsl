// Rays of a rough mirror: of sixteen directions of its lobe, each pixel of a square of four by four sends one, and each pixel shows the mean of what those
// around it bring.
//
// Method: Keller, Heidrich, *Interleaved sampling*, 2001; directions by the normals that an eye sees of a GGX surface, as Dupuy and Benyoub draw them
// (*Sampling visible GGX normals with spherical caps*, 2023).

const LOBE_SIDE = 4;

// A point of the unit square, in the middle of its step: Hammersley's, which the sixteen pixels of a square take in Bayer's order, so that any half of
// the square has every other one.
fn lobe_point(pixel: vec2i) -> vec2f {
    let place = vec2u(pixel) % u32(LOBE_SIDE);
    let mixed = place.x ^ place.y;
    let index = ((mixed & 1u) << 3u) | ((place.y & 1u) << 2u) | (mixed & 2u) | (place.y >> 1u);
    let turned = ((index & 1u) << 3u) | ((index & 2u) << 1u) | ((index & 4u) >> 1u) | (index >> 3u);
    return (vec2f(f32(index), f32(turned)) + 0.5) / 16.0;
}

// Two vectors that make a frame with a unit normal (Duff and others, *Building an orthonormal basis, revisited*, 2017).
fn frame_of(n: vec3f) -> mat3x3f {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return mat3x3f(vec3f(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3f(b, sign + n.y * n.y * a, -n.y), n);
}

// A mirrored direction by one of the facets that an eye sees, of unit length. What would go into the surface, after a second bounce leaves it: about as
// steeply as it went in.
fn lobe_direction(normal: vec3f, to_eye: vec3f, alpha: f32, point: vec2f) -> vec3f {
    let world_from_local = frame_of(normal);
    let eye = to_eye * world_from_local;
    let stretched = normalize(vec3f(eye.xy * alpha, eye.z));
    let turn = 6.28318530718 * point.x;
    let z = (1.0 - point.y) * (1.0 + stretched.z) - stretched.z;
    let across = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let facet = vec3f(across * cos(turn), across * sin(turn), z) + stretched;
    let half_way = normalize(vec3f(facet.xy * alpha, facet.z));
    var leaving = reflect(-eye, half_way);
    leaving.z = abs(leaving.z);
    return world_from_local * leaving;
}
