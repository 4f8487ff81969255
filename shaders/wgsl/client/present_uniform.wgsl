// How a picture is shown: the twin of `PresentUniform` of the client.
#import "common/srgb.wgsl"

struct Present {
    // sRGB-encoded, shown where there is no surface.
    background: vec3f,
    // 1: fill small holes.
    fill: u32,
    // sRGB-encoded, for `mark_uncovered`.
    mark: vec3f,
    // 1: show `mark` wherever there is no surface.
    mark_uncovered: u32,
    // 1: the target encodes sRGB itself.
    target_encodes: u32,
    // 1: alpha is 1 where there is a surface and 0 elsewhere, filled or not; otherwise it is 1 everywhere.
    coverage_in_alpha: u32,
    // Samples of a pixel along each side: the lit picture is so many times as wide and as high.
    samples: u32,
    padding_0: u32,
}

// Linear light as the target takes it.
fn presented(present: Present, linear: vec3f, covered: bool) -> vec4f {
    let alpha = select(0.0, 1.0, covered || present.coverage_in_alpha == 0u);
    return vec4f(select(srgb_from_linear(linear), linear, present.target_encodes != 0u), alpha);
}
