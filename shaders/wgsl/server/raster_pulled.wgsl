// Entry points of the passes that rasterize the scene, where fragments do not know their triangle: corners are not shared,
// the vertex stage reads them from storage buffers and counts triangles. Slower, and equal in every id.
#import "server/image.wgsl"
#import "server/truth.wgsl"

@group(1) @binding(2) var<storage, read> vertex_words: array<u32>;
@group(1) @binding(3) var<storage, read> vertex_indices: array<u32>;

// Words of a vertex: position 3, normal 3, texture coordinates 2, colour 1.
const VERTEX_WORDS: u32 = 9u;

@vertex
fn vertex(@builtin(vertex_index) place: u32, @builtin(instance_index) instance: u32) -> Varying {
    let first_index = instances[instance].first_index;
    let at = (instances[instance].first_vertex + vertex_indices[place]) * VERTEX_WORDS;
    var vertex: MeshVertex;
    vertex.position = bitcast<vec3f>(vec3u(vertex_words[at], vertex_words[at + 1u], vertex_words[at + 2u]));
    vertex.normal = bitcast<vec3f>(vec3u(vertex_words[at + 3u], vertex_words[at + 4u], vertex_words[at + 5u]));
    vertex.uv = bitcast<vec2f>(vec2u(vertex_words[at + 6u], vertex_words[at + 7u]));
    vertex.colour = unpack4x8unorm(vertex_words[at + 8u]);
    return corner(vertex, instance, (place - first_index) / 3u);
}

@fragment
fn image(v: Varying, @builtin(front_facing) front: bool) -> ImageTargets {
    return image_fragment(v, front, v.triangle);
}

@fragment
fn truth(v: Varying, @builtin(front_facing) front: bool) -> TruthTargets {
    return truth_fragment(v, front, v.triangle);
}
