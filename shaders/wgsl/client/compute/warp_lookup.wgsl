// Which pixels do not see some of a lamp's points, by the maps that `client/compute/warp.wgsl` drew: `client/soft_compare.wgsl` of many at
// once.
#import "client/fullscreen.wgsl"
#import "client/soft_receiver.wgsl"

// A layer for each of the points.
@group(0) @binding(6) var maps: texture_2d_array<f32>;

@fragment
fn hidden_by_maps(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let sum = hidden_weights(receiver_at(position));
    if all(sum == vec4f(0.0)) {
        discard;
    }
    return sum;
}

// Returns early where nothing is: what is discarded may go on, and pay for the loop.
fn hidden_weights(receiver: Receiver) -> vec4f {
    var sum = vec4f(0.0);
    if receiver.own_w == 0.0 {
        return sum;
    }
    for (var index = 0u; index < points.point_count; index++) {
        let place = points.places[index];
        let at = receiver.image_px - place.xy * receiver.own_w + place.zw;
        let texel = floor(at);
        let t = vec2i(texel);
        // Places below zero wrap to great ones.
        if all(vec2u(t) < points.size_px) {
            // As in `client/soft_compare.wgsl`, with both sides of the comparison times the cosine.
            let facing = receiver.facing + dot(receiver.normal.xy, place.xy);
            let caster_w = textureLoad(maps, t, i32(index), 0).x;
            let over = (caster_w - receiver.least_w) * facing + dot(receiver.normal.xy, texel + 0.5 - at);
            if facing <= 0.0 || (caster_w > 0.0 && over > receiver.rise) {
                sum += points.weights[index];
            }
        }
    }
    return sum;
}
