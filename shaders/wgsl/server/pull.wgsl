// Corners that the vertex stage reads from storage buffers by itself: it knows their triangle, and may put others
// between them.
#import "server/scene.wgsl"

@group(1) @binding(4) var<storage, read> vertex_words: array<u32>;
@group(1) @binding(5) var<storage, read> vertex_indices: array<u32>;

// Words of a vertex: position 3, normal 3, texture coordinates 2, colour 1.
const VERTEX_WORDS: u32 = 9u;

// Of all vertices, that of a number.
fn pulled_vertex(vertex_index: u32) -> MeshVertex {
    let at = vertex_index * VERTEX_WORDS;
    var vertex: MeshVertex;
    vertex.position = bitcast<vec3f>(vec3u(vertex_words[at], vertex_words[at + 1u], vertex_words[at + 2u]));
    vertex.normal = bitcast<vec3f>(vec3u(vertex_words[at + 3u], vertex_words[at + 4u], vertex_words[at + 5u]));
    vertex.uv = bitcast<vec2f>(vec2u(vertex_words[at + 6u], vertex_words[at + 7u]));
    vertex.colour = unpack4x8unorm(vertex_words[at + 8u]);
    return vertex;
}

// The corner at a place in the index buffer.
fn pulled_corner(place: u32, instance: u32) -> Varying {
    let index = instances[instance].first_vertex + vertex_indices[place];
    return corner(pulled_vertex(index), index, instance, (place - instances[instance].first_index) / 3u);
}
