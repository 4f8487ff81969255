// Which tiles of a picture hold rays that are followed.
#import "client/fullscreen.wgsl"
#import "client/reflect/tile.wgsl"

@group(0) @binding(0) var first: texture_2d<u32>;

@fragment
fn tiles(@builtin(position) position: vec4f) -> @location(0) vec4u {
    let corner = tile_corner_px(vec2i(position.xy));
    let size = vec2i(textureDimensions(first));
    var in_all = 0u;
    for (var index = 0; index < TILE_PX * TILE_PX; index++) {
        let pixel = corner + vec2i(index % TILE_PX, index / TILE_PX);
        if is_pixel(pixel, size) {
            in_all |= tile_bit(textureLoad(first, pixel, 0).w);
        }
    }
    return tile_texel(Tile(in_all, 0u, 0.0, 0.0));
}
