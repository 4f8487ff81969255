// The walk along a ray's projection: the twin of `impostor`'s `Method::Hierarchy`.
#import "impostor/crossing.wgsl"

const IMPOSTOR_MAX_HALVINGS = 16u;
const IMPOSTOR_MAX_STEPS = 65536u;
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

// The first crossing of a clipped curve. A stretch is 2^level of IMPOSTOR_MAX_STEPS equal parts of s.
fn impostor_walk(impostor: Impostor, texels: texture_2d<f32>, ranges: texture_2d<f32>, curve: ImpostorCurve) -> ImpostorHit {
    if !curve.is_there {
        return impostor_miss(0u);
    }
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
    if curve.ends_open && at >= IMPOSTOR_MAX_STEPS {
        var end = impostor_open_end(texels, vec4f(curve_image(impostor, curve, 1.0), curve_t(curve, 1.0)));
        end.steps = steps;
        return end;
    }
    return impostor_miss(steps);
}
