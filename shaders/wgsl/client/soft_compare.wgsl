// Which pixels do not see one of a lamp's points, by its shadow map. See `client::soft`.
// Positions are relative to the output eye, with the world's axes.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"

struct PointMap {
    // Takes a point to the map's eye space.
    map_from_view: mat4x3f,
    // What is written where the point is hidden.
    weights: vec4f,
    centre_px: vec2f,
    size_px: vec2f,
    focal_px: f32,
    // Nothing nearer to the light is in the map.
    near_m: f32,
    // How far rounding moves an inverse depth, as a share of it.
    rounding: f32,
    // Over how many texels what the plane rises hides nothing.
    rise_texels: f32,
}

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(2) var<uniform> map: PointMap;
@group(0) @binding(3) var w: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
// Inverse depth of what casts; 0 where nothing does.
@group(0) @binding(5) var map_w: texture_2d<f32>;

@fragment
fn hidden(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let inverse_depth = textureLoad(w, pixel, 0).x;
    if inverse_depth == 0.0 {
        discard;
    }
    let point = pinhole_eye_from_image(camera, position.xy, inverse_depth) * camera.eye_from_world;
    let p = map.map_from_view * vec4f(point, 1.0);
    if p.z < map.near_m {
        discard;
    }
    let image_px = map.focal_px * p.xy / p.z + map.centre_px;
    if any(image_px < vec2f(0.0)) || any(image_px >= map.size_px) {
        discard;
    }
    let ids = textureLoad(normal_ids, pixel, 0).xy;
    let is_double_sided = (material_table[(ids.y >> 16u) & 0xffu].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    let octahedral = octahedral_normal_fine(ids.x);
    let turned = is_double_sided && dot(octahedral, point) > 0.0;
    let normal = map.map_from_view * vec4f(select(octahedral, -octahedral, turned), 0.0);
    // The cosine to the light, times the distance.
    let facing = -dot(normal, p);
    if facing <= 0.0 {
        // It faces away.
        return map.weights;
    }
    let texel = floor(image_px);
    // On a plane inverse depth is linear in the image: 1/z = dot(normal, ray) / dot(normal, p).
    let slope = -normal.xy / (map.focal_px * facing);
    let own_w = 1.0 / p.z;
    let slack = map.rise_texels * (abs(slope.x) + abs(slope.y)) + map.rounding * own_w;
    let plane_w = own_w + dot(slope, texel + 0.5 - image_px);
    let caster_w = textureLoad(map_w, vec2i(texel), 0).x;
    if caster_w <= max(plane_w + slack, 0.0) {
        discard;
    }
    return map.weights;
}
