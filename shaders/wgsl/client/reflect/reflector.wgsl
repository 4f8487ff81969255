// Which materials rays go on from, by the twin of `Material::effect` of the protocol; and how.
#import "common/shade.wgsl"

const MIRROR_METALLIC_MIN = 0.9;
const MIRROR_ROUGHNESS_MAX = 0.1;
const GLASS_TRANSMISSION_MIN = 0.5;

fn is_mirror(material: Material) -> bool {
    return material.metallic >= MIRROR_METALLIC_MIN && material.roughness <= MIRROR_ROUGHNESS_MAX;
}

// The client marks those, under a sky alone: `Material::is_rough_mirror`.
fn is_rough_mirror(material: Material) -> bool {
    return (material.flags & MATERIAL_ROUGH_MIRROR) != 0u;
}

fn is_glass(material: Material) -> bool {
    return material.transmission >= GLASS_TRANSMISSION_MIN;
}

// Cosine of how far a normal may turn from a pixel to those beside it: 15 degrees. Beyond, there is an edge.
const NORMAL_TURN_COS = 0.966;

struct Round {
    // How many mirrors a ray may leave.
    bounces: u32,
    // 1: no ray is followed after this.
    is_last: u32,
    // From the pixel's centre to where this ray passes, pixels.
    offset_px: vec2f,
}
