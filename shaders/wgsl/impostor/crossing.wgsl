// One step of a walk: the twin of `impostor`'s `Impostor::crossing`.
#import "impostor/curve.wgsl"

const IMPOSTOR_MISS = 0;
const IMPOSTOR_FRONT = 1;
const IMPOSTOR_BACK = 2;

struct ImpostorHit {
    // The ray's parameter.
    t: f32,
    // IMPOSTOR_MISS, or the side that is met, as the impostor's camera sees it.
    side: i32,
    // The sample that is met.
    pixel: vec2i,
    // (u, v, w)
    image: vec3f,
    // Stretches and steps so far.
    steps: u32,
}

// Between (u, v, w, t) of two points at most a pixel apart.
struct ImpostorStep {
    start: vec4f,
    to: vec4f,
}

fn impostor_miss(steps: u32) -> ImpostorHit {
    return ImpostorHit(0.0, IMPOSTOR_MISS, vec2i(0), vec3f(0.0), steps);
}

fn step_image(step: ImpostorStep, share: f32) -> vec3f {
    return mix(step.start.xyz, step.to.xyz, share);
}

// What is met at a share of the way by a ray that was `ahead_w` before it.
fn step_hit(step: ImpostorStep, share: f32, pixel: vec2i, ahead_w: f32) -> ImpostorHit {
    let image = step_image(step, share);
    let t = step.start.w + (step.to.w - step.start.w) * (share * step.to.z / image.z);
    return ImpostorHit(t, select(IMPOSTOR_BACK, IMPOSTOR_FRONT, ahead_w > 0.0), pixel, image, 0u);
}

// Where a step crosses the border of a pixel along one axis, as a share of the way; 1 where it does not.
fn border_share(start: f32, to: f32) -> f32 {
    let border = max(floor(start), floor(to));
    return select((border - start) / (to - start), 1.0, floor(start) == floor(to));
}

// The first crossing on a step: through the plane of a pixel, within that pixel; or, on the border of two that show one
// surface, between their planes.
fn impostor_crossing(texels: texture_2d<f32>, step: ImpostorStep) -> ImpostorHit {
    let across = border_share(step.start.x, step.to.x);
    let down = border_share(step.start.y, step.to.y);
    var before = vec4f(0.0);
    var pixel_before = vec2i(0);
    var enters = 0.0;
    for (var stretch = 0; stretch < 3; stretch++) {
        var leaves = 1.0;
        if stretch == 0 {
            leaves = min(across, down);
        } else if stretch == 1 {
            leaves = max(across, down);
        }
        let pixel = vec2i(floor(step_image(step, (enters + leaves) * 0.5).xy));
        let texel = impostor_texel(texels, pixel);
        if texel.x > 0.0 {
            let image = step_image(step, enters);
            let ahead_w = impostor_ahead_w(texel, pixel, image);
            if before.x > 0.0 {
                let ahead_before_w = impostor_ahead_w(before, pixel_before, image);
                let changes_side = (ahead_before_w > 0.0) != (ahead_w > 0.0);
                if changes_side && impostor_is_one_surface(before, texel, pixel - pixel_before) {
                    return step_hit(step, enters, pixel, ahead_before_w);
                }
            }
            let ahead_later_w = impostor_ahead_w(texel, pixel, step_image(step, leaves));
            if (ahead_w > 0.0) != (ahead_later_w > 0.0) {
                let share = enters + (leaves - enters) * (ahead_w / (ahead_w - ahead_later_w));
                return step_hit(step, share, pixel, ahead_w);
            }
        }
        if leaves >= 1.0 {
            break;
        }
        before = texel;
        pixel_before = pixel;
        enters = leaves;
    }
    return impostor_miss(0u);
}

// The end of a curve that ends open counts as met where the ray is before the surface, and within what the pixel spans in depth.
fn impostor_open_end(texels: texture_2d<f32>, end: vec4f) -> ImpostorHit {
    let pixel = vec2i(floor(end.xy));
    let texel = impostor_texel(texels, pixel);
    let greatest_w = texel.x + (abs(texel.y) + abs(texel.z)) * 0.5 + texel.w;
    if texel.x > 0.0 && impostor_ahead_w(texel, pixel, end.xyz) > 0.0 && end.z <= greatest_w {
        return ImpostorHit(end.w, IMPOSTOR_FRONT, pixel, end.xyz, 0u);
    }
    return impostor_miss(0u);
}
