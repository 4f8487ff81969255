// Entry points of the passes that rasterize the scene, where fragments do not know their triangle: corners are not shared,
// the vertex stage reads them from storage buffers and counts triangles. Slower, and equal in every id.
#import "server/pull.wgsl"
#import "server/finer.wgsl"
#import "server/image.wgsl"
#import "server/truth.wgsl"

@vertex
fn vertex(@builtin(vertex_index) place: u32, @builtin(instance_index) instance: u32) -> Varying {
    return pulled_corner(place, instance);
}

@fragment
fn image(v: Varying, @builtin(front_facing) front: bool) -> ImageTargets {
    return image_fragment(v, front, v.triangle);
}

@fragment
fn plain(v: Varying, @builtin(front_facing) front: bool) -> ImageTargets {
    return plain_fragment(v, front, v.triangle);
}

@fragment
fn object(v: Varying, @builtin(front_facing) front: bool) -> @location(0) u32 {
    return object_fragment(v, front, v.triangle);
}

@fragment
fn truth(v: Varying, @builtin(front_facing) front: bool) -> TruthTargets {
    return truth_fragment(v, front, v.triangle);
}
