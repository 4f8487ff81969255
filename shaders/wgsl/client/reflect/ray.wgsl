// What has become of a pixel's ray so far, in 32 bytes: two texels of four words, as much as the least GPU draws at once.
#import "common/octahedral.wgsl"

// The pixel shows no reflector.
const RAY_NONE = 0u;
// Nothing more will come to its light.
const RAY_DONE = 1u;
const RAY_OUTSIDE = 2u;
// Within glass.
const RAY_INSIDE = 3u;

struct PixelRay {
    state: u32,
    // How many mirrors it may still leave.
    bounces: u32,
    // The material code of the glass that it is in.
    material: u32,
    // One more than the object that it left or is in; 0 for none.
    object: u32,
    // 1 once it has passed glass: what it ends in is seen as what lies beside the glass.
    through: u32,
    // The squared roughness of the rough mirror that it left, one ray of its lobe; 0 of rays that stand for all that is mirrored.
    lobe: f32,
    // Relative to the output eye, metres, world axes.
    origin: vec3f,
    // Unit length.
    direction: vec3f,
    // Linear RGB: the share of what the ray meets that arrives at the eye.
    throughput: vec3f,
    // Linear RGB that arrives at the eye already, in the lights' units.
    light: vec3f,
}

struct RayTexels {
    // The bits of the origin; from bit 0 of the last word: state (2), bounces (2), material (8), object (17), through (1), whether the material is a lobe (1).
    @location(0) first: vec4u,
    // The direction, an octahedral code of 16 + 16 bits; throughput and light, halves.
    @location(1) second: vec4u,
}

// The widest lobe of a rough mirror: the square of its greatest roughness.
const LOBE_MAX = 0.25;
// The largest half.
const HALF_MAX = 65504.0;

fn ray_without_reflector() -> PixelRay {
    return PixelRay(RAY_NONE, 0u, 0u, 0u, 0u, 0.0, vec3f(0.0), vec3f(0.0, 0.0, 1.0), vec3f(0.0), vec3f(0.0));
}

fn ray_is_followed(ray: PixelRay) -> bool {
    return ray.state >= RAY_OUTSIDE;
}

fn ray_texels(ray: PixelRay) -> RayTexels {
    let throughput = min(ray.throughput, vec3f(HALF_MAX));
    let light = min(ray.light, vec3f(HALF_MAX));
    let is_of_lobe = ray.lobe > 0.0;
    let lobe = u32(ceil(ray.lobe / LOBE_MAX * 255.0));
    let material = select(ray.material, lobe, is_of_lobe);
    let flags = (ray.through << 29u) | (u32(is_of_lobe) << 30u);
    let word = ray.state | (ray.bounces << 2u) | (material << 4u) | (ray.object << 12u) | flags;
    return RayTexels(
        vec4u(bitcast<vec3u>(ray.origin), word),
        vec4u(
            octahedral_code_fine(ray.direction),
            pack2x16float(throughput.xy),
            pack2x16float(vec2f(throughput.z, light.x)),
            pack2x16float(light.yz),
        ),
    );
}

fn ray_from_texels(first: vec4u, second: vec4u) -> PixelRay {
    let throughput_xy = unpack2x16float(second.y);
    let both = unpack2x16float(second.z);
    let light_yz = unpack2x16float(second.w);
    let material = (first.w >> 4u) & 0xffu;
    let is_of_lobe = (first.w >> 30u) != 0u;
    return PixelRay(
        first.w & 3u,
        (first.w >> 2u) & 3u,
        select(material, 0u, is_of_lobe),
        (first.w >> 12u) & 0x1ffffu,
        (first.w >> 29u) & 1u,
        select(0.0, f32(material) / 255.0 * LOBE_MAX, is_of_lobe),
        bitcast<vec3f>(first.xyz),
        octahedral_normal_fine(second.x),
        vec3f(throughput_xy, both.x),
        vec3f(both.y, light_yz),
    );
}
