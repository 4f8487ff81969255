// The walks along a ray's projection: the twins of `impostor`'s `Method`.
#import "impostor/crossing.wgsl"

const IMPOSTOR_FINE = 0u;
const IMPOSTOR_COARSE = 1u;
const IMPOSTOR_HIERARCHY = 2u;

// How to walk, one of the above.
override impostor_method: u32 = 2u;
// The length of a coarse stretch.
override impostor_coarse_px: f32 = 6.0;

// Where a walk along one curve gives up. Rays through a maze take 50 stretches and steps in the mean, and one in a few thousand, along
// a wall, more than 500.
const IMPOSTOR_STEP_CAP = 1024u;

// Of a number above 0: GLSL ES 3.00, which WebGL2 speaks, has no function for it. A float holds a power of two exactly.
fn trailing_zeros(number: u32) -> u32 {
    return u32(log2(f32(number & (~number + 1u))) + 0.5);
}

// Whether a surface in the pixels around a stretch of the curve meets its depths.
fn impostor_may_cross(impostor: Impostor, ranges: texture_2d<f32>, start: vec3f, to: vec3f, length_px: f32) -> bool {
    let way_px = to.xy - start.xy;
    let detour_px = sqrt(max(length_px * length_px - dot(way_px, way_px), 0.0)) * 0.5;
    let low_px = min(start.xy, to.xy) - detour_px;
    let high_px = max(start.xy, to.xy) + detour_px;
    let surface_w = impostor_range_over(impostor, ranges, low_px, high_px);
    return surface_w.x <= max(start.z, to.z) && surface_w.y >= min(start.z, to.z);
}

// In fine steps over a part of a curve.
fn impostor_walk_fine(impostor: Impostor, texels: texture_2d<f32>, curve: ImpostorCurve, s_from: f32, s_to: f32) -> ImpostorHit {
    var s = s_from;
    var start = vec4f(curve_image(impostor, curve, s), curve_t(curve, s));
    var steps = 0u;
    for (; steps < IMPOSTOR_MAX_STEPS && s < s_to; steps++) {
        s = curve_stretch_end(impostor, curve, s, s_to, impostor.fine_px);
        let to = vec4f(curve_image(impostor, curve, s), curve_t(curve, s));
        var hit = impostor_crossing(texels, ImpostorStep(start, to));
        if hit.side != IMPOSTOR_MISS {
            hit.steps = steps + 1u;
            return hit;
        }
        start = to;
    }
    return impostor_miss(steps);
}

// Stretches of one length; those which something meets are walked in fine steps.
fn impostor_walk_coarse(impostor: Impostor, texels: texture_2d<f32>, ranges: texture_2d<f32>, curve: ImpostorCurve) -> ImpostorHit {
    let stretch_px = max(impostor_coarse_px, impostor.fine_px);
    var s_from = 0.0;
    var steps = 0u;
    for (var stretch = 0u; stretch < IMPOSTOR_MAX_STEPS && s_from < 1.0; stretch++) {
        let s_to = curve_stretch_end(impostor, curve, s_from, 1.0, stretch_px);
        let length_px = curve_length_bound_px(impostor, curve, s_from, s_to);
        let start = curve_image(impostor, curve, s_from);
        steps += 1u;
        if impostor_may_cross(impostor, ranges, start, curve_image(impostor, curve, s_to), length_px) {
            var hit = impostor_walk_fine(impostor, texels, curve, s_from, s_to);
            steps += hit.steps;
            if hit.side != IMPOSTOR_MISS {
                hit.steps = steps;
                return hit;
            }
        }
        s_from = s_to;
    }
    return impostor_miss(steps);
}

// A stretch is 2^level of IMPOSTOR_MAX_STEPS equal parts of s.
fn impostor_walk_hierarchy(impostor: Impostor, texels: texture_2d<f32>, ranges: texture_2d<f32>, curve: ImpostorCurve) -> ImpostorHit {
    var at = 0u;
    var level = IMPOSTOR_MAX_HALVINGS;
    var steps = 0u;
    for (; steps < IMPOSTOR_STEP_CAP && at < IMPOSTOR_MAX_STEPS; steps++) {
        let s_from = f32(at) / f32(IMPOSTOR_MAX_STEPS);
        let s_to = f32(at + (1u << level)) / f32(IMPOSTOR_MAX_STEPS);
        let start = curve_image(impostor, curve, s_from);
        let to = curve_image(impostor, curve, s_to);
        let length_px = curve_length_bound_px(impostor, curve, s_from, s_to);
        if level == 0u || length_px <= impostor.fine_px {
            let step = ImpostorStep(vec4f(start, curve_t(curve, s_from)), vec4f(to, curve_t(curve, s_to)));
            var hit = impostor_crossing(texels, step);
            if hit.side != IMPOSTOR_MISS {
                hit.steps = steps + 1u;
                return hit;
            }
        } else if impostor_may_cross(impostor, ranges, start, to, length_px) {
            level -= 1u;
            continue;
        }
        at += 1u << level;
        level = min(level + 1u, trailing_zeros(at));
    }
    return impostor_miss(steps);
}

// The first crossing of a clipped curve.
fn impostor_walk(impostor: Impostor, texels: texture_2d<f32>, ranges: texture_2d<f32>, curve: ImpostorCurve) -> ImpostorHit {
    if !curve.is_there {
        return impostor_miss(0u);
    }
    var hit: ImpostorHit;
    if impostor_method == IMPOSTOR_FINE {
        hit = impostor_walk_fine(impostor, texels, curve, 0.0, 1.0);
    } else if impostor_method == IMPOSTOR_COARSE {
        hit = impostor_walk_coarse(impostor, texels, ranges, curve);
    } else {
        hit = impostor_walk_hierarchy(impostor, texels, ranges, curve);
    }
    let gave_up = impostor_method == IMPOSTOR_HIERARCHY && hit.steps >= IMPOSTOR_STEP_CAP;
    if hit.side == IMPOSTOR_MISS && curve.ends_open && !gave_up {
        let steps = hit.steps;
        hit = impostor_open_end(texels, vec4f(curve_image(impostor, curve, 1.0), curve_t(curve, 1.0)));
        hit.steps = steps;
    }
    return hit;
}
