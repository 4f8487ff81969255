// The last step: surfaces as lit, and for pixels without one the background, a plausible fill of small holes, or a mark.
#import "client/fullscreen.wgsl"
#import "client/present_uniform.wgsl"

@group(0) @binding(0) var<uniform> present: Present;
@group(0) @binding(1) var lit: texture_2d<f32>;
// Of each level of the pyramid: colour and covered share, and how much goes on (`client/pull_level.wgsl`).
@group(0) @binding(2) var level_1: texture_2d<f32>;
@group(0) @binding(3) var open_1: texture_2d<f32>;
@group(0) @binding(4) var level_2: texture_2d<f32>;
@group(0) @binding(5) var open_2: texture_2d<f32>;
@group(0) @binding(6) var level_3: texture_2d<f32>;
@group(0) @binding(7) var open_3: texture_2d<f32>;
@group(0) @binding(8) var level_4: texture_2d<f32>;
@group(0) @binding(9) var open_4: texture_2d<f32>;
@group(0) @binding(10) var level_5: texture_2d<f32>;
@group(0) @binding(11) var open_5: texture_2d<f32>;
// What it is seen through (`client/layers.wgsl`), for `show_through` alone.
@group(0) @binding(12) var over_light: texture_2d<f32>;
@group(0) @binding(13) var over_through: texture_2d<f32>;

// A hole is filled at the first level whose neighbourhood is covered by more than this: beside the straight edge of a
// surface before the sky it stays below a half at every level, so that nothing grows into the sky.
const ENCLOSED: f32 = 0.7;

struct Around {
    // sRGB-encoded; the covered share in alpha.
    colour: vec4f,
    // Above zero where most of the surface's border goes on, below where most of it ends.
    open: f32,
}

// Bilinear, by the four texels around: what weighs by coverage, and the coverage.
fn level_at(level: texture_2d<f32>, open: texture_2d<f32>, pixel: vec2f, scale: f32) -> Around {
    let place = pixel / scale - 0.5;
    let base = floor(place);
    let part = place - base;
    let last = vec2i(textureDimensions(level)) - 1;
    var sum = vec4f(0.0);
    var open_sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let step = vec2u(i & 1u, i >> 1u);
        let weights = select(1.0 - part, part, step == vec2u(1u));
        let weight = weights.x * weights.y;
        let texel = clamp(vec2i(base) + vec2i(step), vec2i(0), last);
        let value = textureLoad(level, texel, 0);
        sum += vec4f(value.rgb * value.a, value.a) * weight;
        open_sum += textureLoad(open, texel, 0).y * weight;
    }
    // Never divides by 0. Only what is covered by more than ENCLOSED is shown, so any number does that is smaller.
    return Around(vec4f(sum.rgb / max(sum.a, 1e-6), sum.a), open_sum);
}

fn around(pixel: vec2f) -> Around {
    var value = level_at(level_1, open_1, pixel, 2.0);
    if value.colour.a <= ENCLOSED {
        value = level_at(level_2, open_2, pixel, 4.0);
    }
    if value.colour.a <= ENCLOSED {
        value = level_at(level_3, open_3, pixel, 8.0);
    }
    if value.colour.a <= ENCLOSED {
        value = level_at(level_4, open_4, pixel, 16.0);
    }
    // As many pixels of the picture, where each has several samples.
    if value.colour.a <= ENCLOSED && present.samples > 1u {
        value = level_at(level_5, open_5, pixel, 32.0);
    }
    return value;
}

fn shown(pixel: vec2f) -> vec3f {
    let surface = textureLoad(lit, vec2i(pixel), 0);
    if surface.a > 0.0 {
        return surface.rgb;
    }
    if present.mark_uncovered != 0u {
        return present.mark;
    }
    if present.fill != 0u {
        // Where a surface ends, it leaves a gap, and no hole.
        let value = around(pixel);
        if value.colour.a > ENCLOSED && value.open >= 0.0 {
            return value.colour.rgb;
        }
    }
    return present.background;
}

@fragment
fn show(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let samples = i32(present.samples);
    if samples == 1 {
        let encoded = shown(position.xy);
        let covered = textureLoad(lit, vec2i(position.xy), 0).a > 0.0;
        let alpha = select(0.0, 1.0, covered || present.coverage_in_alpha == 0u);
        return vec4f(select(encoded, linear_from_srgb(encoded), present.target_encodes != 0u), alpha);
    }
    let first = samples * vec2i(position.xy);
    var linear = vec3f(0.0);
    var covered = 0;
    for (var y = 0; y < samples; y++) {
        for (var x = 0; x < samples; x++) {
            let sample = first + vec2i(x, y);
            linear += linear_from_srgb(shown(vec2f(sample) + 0.5));
            covered += select(0, 1, textureLoad(lit, sample, 0).a > 0.0);
        }
    }
    let all = samples * samples;
    return presented(present, linear / f32(all), 2 * covered >= all);
}

// The same where something is seen through.
@fragment
fn show_through(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let samples = i32(present.samples);
    let first = samples * vec2i(position.xy);
    var linear = vec3f(0.0);
    var covered = 0;
    for (var y = 0; y < samples; y++) {
        for (var x = 0; x < samples; x++) {
            let sample = first + vec2i(x, y);
            let above = textureLoad(over_light, sample, 0);
            linear += above.rgb + textureLoad(over_through, sample, 0).rgb * linear_from_srgb(shown(vec2f(sample) + 0.5));
            covered += select(0, 1, above.a > 0.0 || textureLoad(lit, sample, 0).a > 0.0);
        }
    }
    let all = samples * samples;
    return presented(present, linear / f32(all), 2 * covered >= all);
}
