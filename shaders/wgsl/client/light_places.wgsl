// As `client/light.wgsl`, of an image of any camera: where its samples are comes with it.
#import "client/lit.wgsl"

// Where rays come from, relative to the point that the lighting is relative to.
@group(0) @binding(0) var<uniform> centres: array<vec4f, 256>;
// Places relative to the same point, and which of the centres.
@group(0) @binding(7) var places: texture_2d<f32>;

@fragment
fn light_places(@builtin(position) position: vec4f) -> Lit {
    let pixel = vec2i(position.xy);
    let place = textureLoad(places, pixel, 0);
    let to_eye = normalize(centres[u32(place.w)].xyz - place.xyz);
    return lit_at(pixel, place.xyz, to_eye, 1.0, vec4f(1.0));
}
