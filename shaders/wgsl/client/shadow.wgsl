// How much of a light arrives at each pixel, by one of its shadow maps: the others write the pixels that are theirs. See `client::shadow`.
// Positions are relative to the output eye, with the world's axes.
#import "client/fullscreen.wgsl"
#import "camera/pinhole.wgsl"
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"

// The twin of `client::shadow::pass::MAPS`.
const SHADOW_MAPS: u32 = 6u;

struct ShadowMap {
    // Takes a point to the map's eye space.
    map_from_view: mat4x3f,
    focal_px: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

struct Shadow {
    // 1 in the channel of the light, else 0.
    channel: vec4f,
    map_count: u32,
    // The place of `map` among `maps`.
    own: u32,
    // Of every map.
    side_px: f32,
    // How far rounding moves an inverse depth, as a share of it.
    rounding: f32,
    // Samples of what casts are as wide as so many texels.
    sample_texels: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
    // A point is shown by the first that has it.
    maps: array<ShadowMap, SHADOW_MAPS>,
}

@group(0) @binding(0) var<uniform> camera: Pinhole;
@group(0) @binding(1) var<uniform> material_table: array<Material, 256>;
@group(0) @binding(2) var<uniform> shadow: Shadow;
@group(0) @binding(3) var w: texture_2d<f32>;
@group(0) @binding(4) var normal_ids: texture_2d<u32>;
// Inverse depth of what casts; 0 where nothing does.
@group(0) @binding(5) var map: texture_2d<f32>;

struct Place {
    // In the map's eye space.
    p: vec3f,
    image_px: vec2f,
    // Whether the four texels around it belong to the map.
    is_inside: bool,
}

fn place_in(index: u32, point: vec3f) -> Place {
    let p = shadow.maps[index].map_from_view * vec4f(point, 1.0);
    if p.z <= 0.0 {
        return Place(p, vec2f(0.0), false);
    }
    let image_px = shadow.maps[index].focal_px * p.xy / p.z + 0.5 * shadow.side_px;
    let is_inside = all(image_px >= vec2f(0.5)) && all(image_px <= vec2f(shadow.side_px - 0.5));
    return Place(p, image_px, is_inside);
}

// The share of four texels around that nothing darkens, each compared with the receiver's plane where its own ray meets it.
fn lit_share(place: Place, normal_view: vec3f) -> f32 {
    let normal = shadow.maps[shadow.own].map_from_view * vec4f(normal_view, 0.0);
    // The cosine to the light, times the distance.
    let facing = -dot(normal, place.p);
    if facing <= 0.0 {
        // No light arrives there anyway.
        return 1.0;
    }
    // On a plane inverse depth is linear in the image: 1/z = dot(normal, ray) / dot(normal, p).
    let slope = -normal.xy / (shadow.maps[shadow.own].focal_px * facing);
    let own_w = 1.0 / place.p.z;
    let slack = 0.5 * shadow.sample_texels * (abs(slope.x) + abs(slope.y)) + shadow.rounding * own_w;
    let first = floor(place.image_px - 0.5);
    let part = place.image_px - 0.5 - first;
    var share = 0.0;
    for (var index = 0u; index < 4u; index++) {
        let step = vec2f(f32(index & 1u), f32(index >> 1u));
        let texel = first + step;
        let plane_w = own_w + dot(slope, texel + 0.5 - place.image_px);
        let last = vec2i(textureDimensions(map)) - 1;
        let caster_w = textureLoad(map, clamp(vec2i(texel), vec2i(0), last), 0).x;
        if caster_w <= max(plane_w + slack, 0.0) {
            let weight = mix(1.0 - part, part, step);
            share += weight.x * weight.y;
        }
    }
    return share;
}

@fragment
fn light_share(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let inverse_depth = textureLoad(w, pixel, 0).x;
    let is_first = shadow.own == 0u;
    if inverse_depth == 0.0 {
        return select(vec4f(0.0), shadow.channel, is_first);
    }
    let point = pinhole_eye_from_image(camera, position.xy, inverse_depth) * camera.eye_from_world;
    for (var index = 0u; index < SHADOW_MAPS; index++) {
        if index >= shadow.map_count {
            break;
        }
        let place = place_in(index, point);
        if !place.is_inside {
            continue;
        }
        if index != shadow.own {
            return vec4f(0.0);
        }
        let ids = textureLoad(normal_ids, pixel, 0).xy;
        let is_double_sided = (material_table[(ids.y >> 16u) & 0xffu].flags & MATERIAL_DOUBLE_SIDED) != 0u;
        let normal = octahedral_normal_fine(ids.x);
        let turned = is_double_sided && dot(normal, point) > 0.0;
        return shadow.channel * lit_share(place, select(normal, -normal, turned));
    }
    // Outside of all maps it is lit.
    return select(vec4f(0.0), shadow.channel, is_first);
}
