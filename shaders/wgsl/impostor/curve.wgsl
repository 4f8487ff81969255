// The projection of a straight stretch of a ray: the twin of `impostor`'s `Curve`. It is parametrized by s, 0 to 1, evenly along
// the straight image; w is linear in s.
#import "impostor/image.wgsl"

struct ImpostorCurve {
    from_px: vec2f,
    from_w: f32,
    from_t: f32,
    to_px: vec2f,
    to_w: f32,
    to_t: f32,
    // False where the ray has no image.
    is_there: bool,
    // Whether the ray goes on behind the end, but the camera does not.
    ends_open: bool,
}

fn impostor_push_px(impostor: Impostor, w: f32) -> f32 {
    let share = (impostor.push_from_w - w) / (impostor.push_from_w - impostor.push_to_w);
    return impostor.push_max_px * clamp(share, 0.0, 1.0);
}

fn curve_straight_px(curve: ImpostorCurve, s: f32) -> vec2f {
    return mix(curve.from_px, curve.to_px, s);
}

fn curve_w(curve: ImpostorCurve, s: f32) -> f32 {
    return mix(curve.from_w, curve.to_w, s);
}

// The ray's parameter.
fn curve_t(curve: ImpostorCurve, s: f32) -> f32 {
    return curve.from_t + (curve.to_t - curve.from_t) * (s * curve.to_w / curve_w(curve, s));
}

// Where the push takes (u, v, w) of the pinhole.
fn impostor_image_from_straight(impostor: Impostor, straight: vec3f) -> vec3f {
    let offset_px = straight.xy - impostor.pole_px;
    let pushed_by = impostor_push_px(impostor, straight.z) / max(length(offset_px), impostor.ramp_px);
    return vec3f(impostor.pole_px + offset_px * (1.0 + pushed_by), straight.z);
}

// (u, v, w)
fn curve_image(impostor: Impostor, curve: ImpostorCurve, s: f32) -> vec3f {
    return impostor_image_from_straight(impostor, vec3f(curve_straight_px(curve, s), curve_w(curve, s)));
}

fn distance_to_segment(point: vec2f, a: vec2f, b: vec2f) -> f32 {
    let along = b - a;
    let squared = dot(along, along);
    let share = select(0.0, clamp(dot(point - a, along) / squared, 0.0, 1.0), squared > 0.0);
    return distance(point, a + along * share);
}

// An upper bound of the curve's length between two places, in pixels.
fn curve_length_bound_px(impostor: Impostor, curve: ImpostorCurve, s_from: f32, s_to: f32) -> f32 {
    let straight_px = distance(curve.from_px, curve.to_px);
    let push_from_px = impostor_push_px(impostor, curve_w(curve, s_from));
    let push_to_px = impostor_push_px(impostor, curve_w(curve, s_to));
    let a = curve_straight_px(curve, s_from);
    let b = curve_straight_px(curve, s_to);
    let nearest_px = distance_to_segment(impostor.pole_px, a, b);
    let furthest_px = max(distance(impostor.pole_px, a), distance(impostor.pole_px, b));
    let stretched_px = straight_px * (s_to - s_from) * (1.0 + max(push_from_px, push_to_px) / max(nearest_px, impostor.ramp_px));
    return stretched_px + abs(push_to_px - push_from_px) * min(furthest_px / impostor.ramp_px, 1.0);
}

// No curve is halved more often, nor cut into more steps.
const IMPOSTOR_MAX_HALVINGS = 16u;
const IMPOSTOR_MAX_STEPS = 65536u;

// An upper bound of the curve's speed between two places, in pixels per unit of s; no greater for a part of the stretch.
fn curve_speed_bound_px(impostor: Impostor, curve: ImpostorCurve, s_from: f32, s_to: f32) -> f32 {
    let straight_px = distance(curve.from_px, curve.to_px);
    let push_from_px = impostor_push_px(impostor, curve_w(curve, s_from));
    let push_to_px = impostor_push_px(impostor, curve_w(curve, s_to));
    let push_slope_px = impostor.push_max_px / (impostor.push_from_w - impostor.push_to_w) * abs(curve.to_w - curve.from_w);
    let change_px = select(push_slope_px, 0.0, push_from_px == push_to_px);
    let a = curve_straight_px(curve, s_from);
    let b = curve_straight_px(curve, s_to);
    let nearest_px = distance_to_segment(impostor.pole_px, a, b);
    let furthest_px = max(distance(impostor.pole_px, a), distance(impostor.pole_px, b));
    return straight_px * (1.0 + max(push_from_px, push_to_px) / max(nearest_px, impostor.ramp_px))
        + change_px * min(furthest_px / impostor.ramp_px, 1.0);
}

// Where a stretch ends that begins at s and is at most so long: as far as the speed here allows, or less, where the speed on that way
// does not. The twin of `Stretches`.
fn curve_stretch_end(impostor: Impostor, curve: ImpostorCurve, s: f32, s_end: f32, length_px: f32) -> f32 {
    let reach = length_px / curve_speed_bound_px(impostor, curve, s, s);
    let slow_reach = length_px / curve_speed_bound_px(impostor, curve, s, min(s + reach, s_end));
    let step = max(slow_reach, 1.0 / f32(IMPOSTOR_MAX_STEPS));
    return select(s_end, s + step, step < s_end - s);
}

// (from, to) of s where a value that is linear in s lies between two; empty, from > to, where it never does.
fn clip_linear(range: vec2f, start: f32, to: f32, least: f32, greatest: f32) -> vec2f {
    if start == to {
        return select(vec2f(1.0, 0.0), range, start >= least && start <= greatest);
    }
    let a = (least - start) / (to - start);
    let b = (greatest - start) / (to - start);
    return vec2f(max(range.x, min(a, b)), min(range.y, max(a, b)));
}

// The part whose image may lie inside of the image, and within its depths.
fn curve_clip(impostor: Impostor, curve: ImpostorCurve) -> ImpostorCurve {
    let min_px = min(impostor.pole_px, vec2f(0.0));
    let max_px = max(impostor.pole_px, impostor.size_px);
    var s = clip_linear(vec2f(0.0, 1.0), curve.from_px.x, curve.to_px.x, min_px.x, max_px.x);
    s = clip_linear(s, curve.from_px.y, curve.to_px.y, min_px.y, max_px.y);
    s = clip_linear(s, curve.from_w, curve.to_w, impostor.w_min, impostor.w_max);
    var clipped = curve;
    clipped.is_there = curve.is_there && s.x <= s.y;
    clipped.ends_open = curve.ends_open && s.y >= 1.0;
    clipped.from_px = curve_straight_px(curve, s.x);
    clipped.from_w = curve_w(curve, s.x);
    clipped.from_t = curve_t(curve, s.x);
    clipped.to_px = curve_straight_px(curve, s.y);
    clipped.to_w = curve_w(curve, s.y);
    clipped.to_t = curve_t(curve, s.y);
    return clipped;
}
