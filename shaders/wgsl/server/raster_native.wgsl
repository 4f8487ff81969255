// Entry points of the passes that rasterize the scene, where fragments know their triangle.
enable primitive_index;
#import "server/finer.wgsl"
#import "server/image.wgsl"
#import "server/truth.wgsl"

@vertex
fn vertex(vertex: MeshVertex, @builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    return corner(vertex, index, instance, 0u);
}

@fragment
fn image(v: Varying, @builtin(front_facing) front: bool, @builtin(primitive_index) triangle: u32) -> ImageTargets {
    return image_fragment(v, front, triangle);
}

@fragment
fn plain(v: Varying, @builtin(front_facing) front: bool, @builtin(primitive_index) triangle: u32) -> ImageTargets {
    return plain_fragment(v, front, triangle);
}

@fragment
fn object(v: Varying, @builtin(front_facing) front: bool, @builtin(primitive_index) triangle: u32) -> @location(0) u32 {
    return object_fragment(v, front, triangle);
}

@fragment
fn truth(v: Varying, @builtin(front_facing) front: bool, @builtin(primitive_index) triangle: u32) -> TruthTargets {
    return truth_fragment(v, front, triangle);
}
