//! The scene's triangles for rays: a bounding volume hierarchy that follows the scene, on the CPU and, where asked for, on the GPU.
//!
//! It is built when first used after the scene or its anchor moved, from all triangles of all instances where they are then. That
//! takes some 50 ms for 100,000 triangles; scenes that no ray is asked of pay nothing.

use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Vec3, Vec3A};
use gpu::Gpu;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use scene::{Scene, Snapshot, Vertex};
use wgpu::util::DeviceExt;

use super::error::RenderError;

/// `RAY_LEVELS` of `server/rays.wgsl`.
const MAX_LEVELS: usize = 64;

/// `RayNode` of `server/rays.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct RayNode {
    least: [f32; 3],
    count: u32,
    most: [f32; 3],
    first: u32,
}

impl RayNode {
    /// What no ray enters.
    const NOWHERE: RayNode = RayNode { least: [f32::MAX; 3], count: 0, most: [f32::MIN; 3], first: 0 };
}

/// `RayTriangle` of `server/rays.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct RayTriangle {
    corner: [f32; 3],
    id: u32,
    edge_1: [f32; 3],
    double_sided: u32,
    edge_2: [f32; 3],
    padding: u32,
}

/// The first triangle along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstHit {
    /// In lengths of the direction.
    pub t: f32,
    /// Id over the whole scene.
    pub triangle: u32,
}

/// What every instance of a mesh shares.
struct MeshPositions {
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
    double_sided: bool,
}

fn positions(vertices: &[Vertex]) -> Vec<[f32; 3]> {
    vertices.iter().map(|vertex| vertex.position).collect()
}

/// Where the scene is.
#[derive(Default)]
struct Placed {
    world_from_mesh: Vec<DAffine3>,
    /// Instances whose vertices changed.
    deformed: Vec<(u32, Vec<[f32; 3]>)>,
    anchor_world: DVec3,
}

/// The scene for rays. Space: metres relative to the renderer's anchor, world axes.
pub struct RayScene {
    meshes: Vec<MeshPositions>,
    /// The mesh of each instance.
    mesh_of: Vec<u32>,
    placed: Placed,
    built: OnceLock<Result<Hierarchy, usize>>,
    uploaded: OnceLock<RayBuffers>,
}

struct Hierarchy {
    bvh: Bvh2,
    /// In the order of the leaves.
    triangles: Vec<RayTriangle>,
}

/// The hierarchy on a GPU.
#[derive(Clone)]
pub(crate) struct RayBuffers {
    pub nodes: wgpu::Buffer,
    pub triangles: wgpu::Buffer,
}

impl RayScene {
    /// Of a scene, at its place at time 0.
    pub(super) fn new(scene: &Scene, anchor_world: DVec3) -> RayScene {
        let mesh = |mesh: &scene::Mesh| MeshPositions {
            positions: positions(&mesh.vertices),
            indices: mesh.indices.clone(),
            double_sided: scene.materials[mesh.material as usize].double_sided,
        };
        let mut rays = RayScene {
            meshes: scene.meshes.iter().map(mesh).collect(),
            mesh_of: scene.instances.iter().map(|instance| instance.mesh).collect(),
            placed: Placed::default(),
            built: OnceLock::new(),
            uploaded: OnceLock::new(),
        };
        rays.update(&scene.at(0.0), anchor_world);
        rays
    }

    pub(super) fn update(&mut self, snapshot: &Snapshot, anchor_world: DVec3) {
        self.placed = Placed {
            world_from_mesh: snapshot.world_from_mesh.clone(),
            deformed: snapshot.deformed.iter().map(|d| (d.instance, positions(&d.vertices))).collect(),
            anchor_world,
        };
        self.built = OnceLock::new();
        self.uploaded = OnceLock::new();
    }

    fn hierarchy(&self) -> Result<&Hierarchy, RenderError> {
        let built = self.built.get_or_init(|| Hierarchy::new(&self.triangles()));
        built.as_ref().map_err(|&levels| RenderError::TooDeep { levels, limit: MAX_LEVELS })
    }

    /// The hierarchy on the GPU, as the scene is now.
    pub(super) fn buffers(&self, gpu: &Gpu) -> Result<&RayBuffers, RenderError> {
        let hierarchy = self.hierarchy()?;
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        let bytes = size_of_val(hierarchy.triangles.as_slice()) as u64;
        if bytes > limit {
            return Err(RenderError::TooLarge { what: "triangles for rays", bytes, limit });
        }
        Ok(self.uploaded.get_or_init(|| RayBuffers::of(hierarchy, gpu)))
    }

    /// Every triangle where it is, in the order of ids.
    fn triangles(&self) -> Vec<RayTriangle> {
        let counts = self.mesh_of.iter().map(|&mesh| self.meshes[mesh as usize].indices.len() as u32 / 3);
        let bases: Vec<u32> = counts.scan(1, |next, count| Some(std::mem::replace(next, *next + count))).collect();
        let of_instance = |instance: usize| {
            let mesh = &self.meshes[self.mesh_of[instance] as usize];
            let deformed = self.placed.deformed.iter().find(|(deformed, _)| *deformed as usize == instance);
            let positions = deformed.map_or(&mesh.positions, |(_, positions)| positions);
            let world_from_mesh = &self.placed.world_from_mesh[instance];
            let place = |index: u32| {
                let p = positions.get(index as usize).copied().unwrap_or_default();
                (world_from_mesh.transform_point3(Vec3::from(p).as_dvec3()) - self.placed.anchor_world).as_vec3()
            };
            let mirrored = world_from_mesh.matrix3.determinant() < 0.0;
            let (corners, _) = mesh.indices.as_chunks::<3>();
            let triangles = corners.iter().zip(bases[instance]..);
            let triangles = triangles.map(|(&[a, b, c], id)| {
                let [a, b, c] = [a, b, c].map(place);
                let (b, c) = if mirrored { (c, b) } else { (b, c) };
                RayTriangle {
                    corner: a.to_array(),
                    id,
                    edge_1: (b - a).to_array(),
                    double_sided: mesh.double_sided.into(),
                    edge_2: (c - a).to_array(),
                    padding: 0,
                }
            });
            triangles.collect::<Vec<_>>()
        };
        (0..self.mesh_of.len()).into_par_iter().flat_map_iter(of_instance).collect()
    }

    /// The first triangle that faces a ray, beyond `t_least` and before `t_most`: the twin of `first_hit` in `server/rays.wgsl`.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3, t_least: f32, t_most: f32) -> Option<FirstHit> {
        let hierarchy = self.hierarchy().ok()?;
        if hierarchy.triangles.is_empty() {
            return None;
        }
        let ray = Ray::new(origin.into(), direction.into(), t_least, t_most);
        let mut hit = RayHit { t: t_most, ..RayHit::none() };
        hierarchy.bvh.ray_traverse(ray, &mut hit, |ray, index| {
            let t = hierarchy.triangles[index].distance(ray.origin, ray.direction);
            if t > t_least { t } else { f32::INFINITY }
        });
        let triangle = hierarchy.triangles.get(hit.primitive_id as usize)?;
        Some(FirstHit { t: hit.t, triangle: triangle.id })
    }
}

impl RayTriangle {
    fn corners(&self) -> [Vec3A; 3] {
        let [corner, edge_1, edge_2] = [self.corner, self.edge_1, self.edge_2].map(Vec3A::from);
        [corner, corner + edge_1, corner + edge_2]
    }

    /// Möller, Trumbore: Fast, Minimum Storage Ray/Triangle Intersection, 1997; infinite for a miss.
    fn distance(&self, origin: Vec3A, direction: Vec3A) -> f32 {
        let [corner, edge_1, edge_2] = [self.corner, self.edge_1, self.edge_2].map(Vec3A::from);
        let p = direction.cross(edge_2);
        let determinant = edge_1.dot(p);
        if determinant == 0.0 || (determinant < 0.0 && self.double_sided == 0) {
            return f32::INFINITY;
        }
        let s = origin - corner;
        let q = s.cross(edge_1);
        let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
        if u < 0.0 || v < 0.0 || u + v > 1.0 { f32::INFINITY } else { edge_2.dot(q) / determinant }
    }
}

impl Hierarchy {
    /// The levels where there are too many.
    fn new(triangles: &[RayTriangle]) -> Result<Hierarchy, usize> {
        if triangles.is_empty() {
            return Ok(Hierarchy { bvh: Bvh2::default(), triangles: Vec::new() });
        }
        let corners = triangles.iter().map(|triangle| {
            let [v0, v1, v2] = triangle.corners();
            Triangle { v0, v1, v2 }
        });
        let corners: Vec<Triangle> = corners.collect();
        let bvh = build_bvh2_from_tris(&corners, BvhBuildParams::fast_build(), &mut std::time::Duration::default());
        let levels = bvh.depth(0);
        if levels > MAX_LEVELS {
            return Err(levels);
        }
        let triangles = bvh.primitive_indices.iter().map(|&index| triangles[index as usize]).collect();
        Ok(Hierarchy { bvh, triangles })
    }
}

impl RayBuffers {
    fn of(hierarchy: &Hierarchy, gpu: &Gpu) -> RayBuffers {
        let node = |node: &obvhs::bvh2::node::Bvh2Node| RayNode {
            least: node.aabb().min.to_array(),
            count: node.prim_count,
            most: node.aabb().max.to_array(),
            first: node.first_index,
        };
        let nodes: Vec<RayNode> = hierarchy.bvh.nodes.iter().map(node).collect();
        if nodes.is_empty() {
            return RayBuffers::empty(gpu);
        }
        RayBuffers::new(gpu, &nodes, &hierarchy.triangles)
    }

    /// What no ray hits, to bind where none is asked for.
    pub(crate) fn empty(gpu: &Gpu) -> RayBuffers {
        RayBuffers::new(gpu, &[RayNode::NOWHERE], &[RayTriangle::zeroed()])
    }

    fn new(gpu: &Gpu, nodes: &[RayNode], triangles: &[RayTriangle]) -> RayBuffers {
        let buffer = |label, contents| {
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        RayBuffers {
            nodes: buffer("ray nodes", bytemuck::cast_slice(nodes)),
            triangles: buffer("ray triangles", bytemuck::cast_slice(triangles)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_laid_out_as_in_wgsl() {
        let path = "server/rays.wgsl";
        shaders::assert_layout!(RayNode, path, "RayNode", least, count, most, first);
        shaders::assert_layout!(RayTriangle, path, "RayTriangle", corner, id, edge_1, double_sided, edge_2);
    }

    #[test]
    fn the_nearest_facing_triangle_is_found() {
        let wall = |z: f32, id: u32, double_sided: u32| RayTriangle {
            corner: [-1.0, -1.0, z],
            id,
            edge_1: [4.0, 0.0, 0.0],
            double_sided,
            edge_2: [0.0, 4.0, 0.0],
            padding: 0,
        };
        let triangles: Vec<_> = (1..=40).map(|id| wall(-(id as f32), id, u32::from(id == 30))).collect();
        let mut rays = RayScene {
            meshes: Vec::new(),
            mesh_of: Vec::new(),
            placed: Placed::default(),
            built: OnceLock::new(),
            uploaded: OnceLock::new(),
        };
        rays.built = OnceLock::from(Hierarchy::new(&triangles));
        let hit = |from: f32, along: f32, least: f32| {
            rays.first_hit(Vec3::new(0.0, 0.0, from), Vec3::new(0.0, 0.0, along), least, 1e9)
        };
        assert_eq!(hit(0.0, -2.0, 0.0), Some(FirstHit { t: 0.5, triangle: 1 }));
        assert_eq!(hit(0.0, -2.0, 0.5), Some(FirstHit { t: 1.0, triangle: 2 }), "beyond the least distance");
        assert_eq!(hit(-50.0, 1.0, 0.0), Some(FirstHit { t: 20.0, triangle: 30 }), "only one is seen from behind");
        assert_eq!(hit(1.0, 1.0, 0.0), None);
    }
}
