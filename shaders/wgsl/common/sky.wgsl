// Light from far around: `protocol::Sky`. Whoever imports this declares `lighting`, and `sky`, a texture in which the levels lie one under the
// other, the first one at the top.
#import "common/octahedral.wgsl"
#import "common/shade.wgsl"

const SKY_LEVELS: u32 = 5u;
const SKY_SIDE_PX: u32 = 256u;

// The light that a matte white surface shows: the twin of `protocol::sky::harmonics`, summed.
fn sky_diffuse(n: vec3f) -> vec3f {
    var light = 0.282095 * lighting.sky_diffuse[0].rgb;
    light += 0.488603 * (n.y * lighting.sky_diffuse[1].rgb + n.z * lighting.sky_diffuse[2].rgb + n.x * lighting.sky_diffuse[3].rgb);
    light += 1.092548 * (n.x * n.y * lighting.sky_diffuse[4].rgb + n.y * n.z * lighting.sky_diffuse[5].rgb);
    light += 0.315392 * (3.0 * n.z * n.z - 1.0) * lighting.sky_diffuse[6].rgb;
    light += (1.092548 * n.x * n.z) * lighting.sky_diffuse[7].rgb + 0.546274 * (n.x * n.x - n.y * n.y) * lighting.sky_diffuse[8].rgb;
    return lighting.sky * max(light, vec3f(0.0));
}

// A texel of a square into which the octahedron is unfolded; past its edges lies its other side.
fn sky_texel(first_row: i32, side: i32, texel: vec2i) -> vec3f {
    var t = texel;
    if t.x < 0 || t.x >= side {
        t = vec2i(clamp(t.x, 0, side - 1), side - 1 - t.y);
    }
    if t.y < 0 || t.y >= side {
        t = vec2i(side - 1 - t.x, clamp(t.y, 0, side - 1));
    }
    return textureLoad(sky, vec2i(t.x, first_row + t.y), 0).rgb;
}

fn sky_level(level: u32, place: vec2f) -> vec3f {
    let side = i32(SKY_SIDE_PX >> level);
    // What the levels before it fill.
    let first_row = i32(2u * ((SKY_SIDE_PX >> lighting.sky_first_level) - (SKY_SIDE_PX >> level)));
    let at = (place * 0.5 + 0.5) * f32(side) - 0.5;
    let corner = vec2i(floor(at));
    let share = at - floor(at);
    let above = mix(sky_texel(first_row, side, corner), sky_texel(first_row, side, corner + vec2i(1, 0)), share.x);
    let below = mix(sky_texel(first_row, side, corner + vec2i(0, 1)), sky_texel(first_row, side, corner + vec2i(1, 1)), share.x);
    return mix(above, below, share.y);
}

// What a surface of a roughness mirrors around a unit direction.
fn sky_mirrored(direction: vec3f, roughness: f32) -> vec3f {
    let place = octahedral(direction);
    let level = max(roughness * f32(SKY_LEVELS - 1u), f32(lighting.sky_first_level));
    let smoother = u32(level);
    let light = sky_level(smoother, place);
    if smoother + 1u >= SKY_LEVELS {
        return lighting.sky * light;
    }
    return lighting.sky * mix(light, sky_level(smoother + 1u, place), level - f32(smoother));
}
