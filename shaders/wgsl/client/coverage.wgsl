// Counts the uncovered pixels of each tile, exactly; the twin of `TILE_PX` in the client.
#import "client/fullscreen.wgsl"

const TILE_PX: i32 = 16;

@group(0) @binding(0) var lit: texture_2d<f32>;

@fragment
fn count_uncovered(@builtin(position) position: vec4f) -> @location(0) u32 {
    let size = vec2i(textureDimensions(lit));
    let base = TILE_PX * vec2i(position.xy);
    let end = min(base + TILE_PX, size);
    var count = 0u;
    for (var y = base.y; y < end.y; y++) {
        for (var x = base.x; x < end.x; x++) {
            count += select(0u, 1u, textureLoad(lit, vec2i(x, y), 0).a == 0.0);
        }
    }
    return count;
}
