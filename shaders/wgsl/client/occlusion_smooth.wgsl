// Shares of ambient light, averaged over the pixels around that show the same surface.
#import "client/fullscreen.wgsl"
#import "common/octahedral.wgsl"

// Relative to the output eye, world axes.
@group(0) @binding(0) var points: texture_2d<f32>;
@group(0) @binding(1) var normal_ids: texture_2d<u32>;
@group(0) @binding(2) var shares: texture_2d<f32>;

const RADIUS_PX: i32 = 2;
// Cosine of the angle by which normals on one surface may differ: 37 degrees.
const SAME_COSINE: f32 = 0.8;
// How steeply a neighbour may stand above or below the tangent plane: the tangent of 27 degrees.
const SAME_SLOPE: f32 = 0.5;

@fragment
fn smooth_shares(@builtin(position) position: vec4f) -> @location(0) f32 {
    let pixel = vec2i(position.xy);
    let point = textureLoad(points, pixel, 0);
    if point.w == 0.0 {
        return 1.0;
    }
    let normal = octahedral_normal_fine(textureLoad(normal_ids, pixel, 0).x);
    let last = vec2i(textureDimensions(points)) - 1;
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -RADIUS_PX; y <= RADIUS_PX; y++) {
        for (var x = -RADIUS_PX; x <= RADIUS_PX; x++) {
            let beside = clamp(pixel + vec2i(x, y), vec2i(0), last);
            let other = textureLoad(points, beside, 0);
            let other_normal = octahedral_normal_fine(textureLoad(normal_ids, beside, 0).x);
            let way = other.xyz - point.xyz;
            let is_same = other.w > 0.0 && dot(other_normal, normal) > SAME_COSINE
                && abs(dot(way, normal)) <= SAME_SLOPE * length(way);
            if is_same {
                // A tent, as wide as the square.
                let weight = f32((RADIUS_PX + 1 - abs(x)) * (RADIUS_PX + 1 - abs(y)));
                sum += weight * textureLoad(shares, beside, 0).x;
                weights += weight;
            }
        }
    }
    return sum / weights;
}
