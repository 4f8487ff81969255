// The first triangle along a ray, by the scene's bounding volume hierarchy. Space: the anchor's, metres, world axes. The twin on the
// CPU is `RayScene::first_hit` of the server.

struct RayNode {
    least: vec3f,
    // Triangles of a leaf; 0 in a node with two children.
    count: u32,
    most: vec3f,
    // The first triangle, or the first of two children.
    first: u32,
}

// Counter-clockwise towards its front, whether its instance is mirrored or not.
struct RayTriangle {
    corner: vec3f,
    // Id over the whole scene.
    id: u32,
    edge_1: vec3f,
    // 1 where it is seen from behind too.
    double_sided: u32,
    edge_2: vec3f,
    padding: u32,
}

struct RayHit {
    // In lengths of the direction.
    t: f32,
    // 0 where there is none.
    triangle: u32,
}

@group(3) @binding(3) var<storage, read> ray_nodes: array<RayNode>;
@group(3) @binding(4) var<storage, read> ray_triangles: array<RayTriangle>;

// Levels of the hierarchy at most; the server refuses deeper ones.
const RAY_LEVELS: u32 = 64u;
// Farther than anything, and a number: an f32 goes up to 3.4e38.
const RAY_FAR: f32 = 3e38;

// Where a ray enters a box, or `RAY_FAR` where it does not before `t_most`.
fn ray_entry(node: RayNode, origin: vec3f, inverse: vec3f, t_least: f32, t_most: f32) -> f32 {
    let a = (node.least - origin) * inverse;
    let b = (node.most - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let entry = max(max(near.x, near.y), max(near.z, t_least));
    let exit = min(min(far.x, far.y), min(far.z, t_most));
    return select(RAY_FAR, entry, entry <= exit);
}

// The distance of a triangle (Möller, Trumbore: Fast, Minimum Storage Ray/Triangle Intersection, 1997), or `RAY_FAR`.
fn ray_distance(triangle: RayTriangle, origin: vec3f, direction: vec3f) -> f32 {
    let p = cross(direction, triangle.edge_2);
    let determinant = dot(triangle.edge_1, p);
    if determinant == 0.0 || (determinant < 0.0 && triangle.double_sided == 0u) {
        return RAY_FAR;
    }
    let s = origin - triangle.corner;
    let u = dot(s, p) / determinant;
    let q = cross(s, triangle.edge_1);
    let v = dot(direction, q) / determinant;
    if u < 0.0 || v < 0.0 || u + v > 1.0 {
        return RAY_FAR;
    }
    return dot(triangle.edge_2, q) / determinant;
}

fn ray_inverse(direction: vec3f) -> vec3f {
    // Along an axis that a ray does not move on, 1 / 0 is infinite, and times a distance of 0 no number. By 1e30 distances of up to 3e8 m stay numbers, while all that is not 0
    // is out of reach.
    let tiny = abs(direction) < vec3f(1e-30);
    return 1.0 / select(direction, select(vec3f(-1e-30), vec3f(1e-30), direction >= vec3f(0.0)), tiny);
}

// The first triangle beyond `t_least` and before `t_most` that faces the ray.
fn first_hit(origin: vec3f, direction: vec3f, t_least: f32, t_most: f32) -> RayHit {
    let inverse = ray_inverse(direction);
    var hit = RayHit(t_most, 0u);
    var waiting: array<u32, RAY_LEVELS>;
    var count = 0u;
    var at = 0u;
    if ray_entry(ray_nodes[0], origin, inverse, t_least, hit.t) == RAY_FAR {
        return hit;
    }
    loop {
        let node = ray_nodes[at];
        if node.count == 0u {
            let first = ray_entry(ray_nodes[node.first], origin, inverse, t_least, hit.t);
            let second = ray_entry(ray_nodes[node.first + 1u], origin, inverse, t_least, hit.t);
            let nearer = select(0u, 1u, second < first);
            if min(first, second) < RAY_FAR {
                if max(first, second) < RAY_FAR && count < RAY_LEVELS {
                    waiting[count] = node.first + 1u - nearer;
                    count++;
                }
                at = node.first + nearer;
                continue;
            }
        } else {
            for (var index = node.first; index < node.first + node.count; index++) {
                let t = ray_distance(ray_triangles[index], origin, direction);
                if t > t_least && t < hit.t {
                    hit = RayHit(t, ray_triangles[index].id);
                }
            }
        }
        if count == 0u {
            return hit;
        }
        count--;
        at = waiting[count];
    }
    return hit;
}
