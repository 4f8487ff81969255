// The fragments of a finer image, which only says which object is where: see `EndsPass` of the server.
#import "server/scene.wgsl"

// Pixels of the finer image that one of the view's is wide.
const SUBPIXELS: i32 = 3;

// By pixel of the view: the nearest depth that is drawn, 0 where nothing is. What is nearer is what the view's samples lie behind.
@group(3) @binding(5) var nearest_drawn: texture_2d<f32>;

// One higher than the object's id; 0 is nothing.
fn object_fragment(v: Varying, front_facing: bool, triangle_of_mesh: u32) -> u32 {
    // Derivatives need all fragments.
    let dx = dpdx(v.uv);
    let dy = dpdy(v.uv);
    if v.clip.z > textureLoad(nearest_drawn, vec2i(v.clip.xy) / SUBPIXELS, 0).x {
        discard;
    }
    let texel = textureSampleGrad(base_texture, base_sampler, v.uv, dx, dy);
    let surface = surface_at(v, front_facing, triangle_of_mesh, texel);
    if surface.cut {
        discard;
    }
    return surface.object + 1u;
}
