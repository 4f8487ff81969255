//! Vertices that change over time: morph targets, then skins (glTF 2.0, 3.7.2.2 and 3.7.3), on the CPU.

use glam::{DAffine3, DMat3, DVec3, Mat3A, Vec3, Vec3A};
use rayon::prelude::*;

use super::attributes::{Influences, MorphTarget};
use super::primitive::Primitive;
use crate::Vertex;

/// Vertices handled by one task: enough to outweigh handing it over.
const VERTICES_PER_TASK: usize = 4096;

/// What one deforming instance needs to compute its vertices.
#[derive(Debug)]
pub(super) struct Deform {
    /// Undeformed, relative to `centre`.
    base: Vec<Vertex>,
    centre: DVec3,
    targets: Vec<MorphTarget>,
    influences: Option<Influences>,
    flat: bool,
    /// Whether the triangles' winding is flipped, so that flat normals are too.
    mirrored: bool,
}

impl Deform {
    /// Of a primitive. `mirrored` where its instance has flipped triangles.
    pub fn of(primitive: &Primitive, mirrored: bool) -> Deform {
        Deform {
            base: primitive.built.mesh.vertices.clone(),
            centre: primitive.built.centre,
            targets: primitive.targets.clone(),
            influences: primitive.influences.clone(),
            flat: primitive.flat,
            mirrored,
        }
    }

    /// Up to four bones a vertex and their shares, where bones alone bend it; `None` where more do.
    pub fn influences(&self) -> Option<Vec<[(u32, f32); 4]>> {
        let influences = self.influences.as_ref().filter(|_| self.targets.is_empty())?;
        let of_vertex = |entries: &[(u32, f32)]| {
            let mut found = [(0, 0.0); 4];
            let mut used = entries.iter().filter(|(_, weight)| *weight > 0.0);
            found.iter_mut().zip(used.by_ref()).for_each(|(found, entry)| *found = *entry);
            used.next().is_none().then_some(found)
        };
        influences.entries.chunks_exact(influences.per_vertex).map(of_vertex).collect()
    }

    /// Whether each triangle is shaded as the plane that it is.
    pub fn is_flat(&self) -> bool {
        self.flat
    }

    /// Places and normals before anything moves them.
    pub fn unbent(&self) -> Vec<[[f32; 3]; 2]> {
        self.base.iter().map(|vertex| [vertex.position, vertex.normal]).collect()
    }

    /// From the mesh's own space to that of the file.
    pub fn file_from_mesh(&self) -> DAffine3 {
        DAffine3::from_translation(self.centre)
    }

    /// The vertices under morph weights, in mesh space: relative to the centre.
    pub fn morphed(&self, weights: &[f32]) -> Vec<Vertex> {
        let active: Vec<(&MorphTarget, f32)> =
            self.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0).map(|(t, w)| (t, *w)).collect();
        let mut vertices = self.base.clone();
        if active.is_empty() {
            return vertices;
        }
        vertices.par_chunks_mut(VERTICES_PER_TASK).enumerate().for_each(|(chunk, vertices)| {
            for (offset, vertex) in vertices.iter_mut().enumerate() {
                let index = chunk * VERTICES_PER_TASK + offset;
                let (mut position, mut normal) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
                for (target, weight) in &active {
                    position += target.positions.get(index).copied().unwrap_or_default() * *weight;
                    normal += target.normals.get(index).copied().unwrap_or_default() * *weight;
                }
                vertex.position = keep_finite(position, vertex.position);
                vertex.normal = normal.try_normalize().map_or(vertex.normal, Into::into);
            }
        });
        if self.flat {
            self.follow_faces(&mut vertices);
        }
        vertices
    }

    /// Moves vertices by their joints. `world_from_bind` of each joint takes the undeformed mesh, in file space, to the
    /// world; the result is relative to `anchor_world`.
    pub fn skin(&self, vertices: &mut [Vertex], world_from_bind: &[DAffine3], anchor_world: DVec3) {
        let Some(influences) = &self.influences else { return };
        let joints: Vec<Joint> =
            world_from_bind.iter().map(|joint| Joint::of(joint, self.centre, anchor_world)).collect();
        vertices.par_chunks_mut(VERTICES_PER_TASK).enumerate().for_each(|(chunk, vertices)| {
            let n = influences.per_vertex;
            let entries = influences.entries[chunk * VERTICES_PER_TASK * n..].chunks_exact(n);
            for (vertex, entries) in vertices.iter_mut().zip(entries) {
                let (p, n) = (Vec3A::from(vertex.position), Vec3A::from(vertex.normal));
                let (mut position, mut normal) = (Vec3A::ZERO, Vec3A::ZERO);
                for &(joint, weight) in entries.iter().filter(|(_, weight)| *weight > 0.0) {
                    let joint = &joints[joint as usize];
                    position += (joint.matrix * p + joint.translation) * weight;
                    normal += joint.normal_matrix * n * weight;
                }
                vertex.position = keep_finite(position.into(), [0.0; 3]);
                vertex.normal = Vec3::from(normal).try_normalize().map_or(vertex.normal, Into::into);
            }
        });
        if self.flat {
            self.follow_faces(vertices);
        }
    }

    /// Flat shading: each triangle has three vertices of its own, in order.
    fn follow_faces(&self, vertices: &mut [Vertex]) {
        for triangle in vertices.as_chunks_mut::<3>().0 {
            let [a, b, c] = [0, 1, 2].map(|corner| Vec3::from(triangle[corner].position));
            let face = (b - a).cross(c - a);
            if let Some(normal) = (if self.mirrored { -face } else { face }).try_normalize() {
                triangle.iter_mut().for_each(|vertex| vertex.normal = normal.into());
            }
        }
    }
}

fn keep_finite(position: Vec3, otherwise: [f32; 3]) -> [f32; 3] {
    if position.is_finite() { position.into() } else { otherwise }
}

/// A joint in f32, small because both ends are relative: from the mesh's centre to the anchor.
struct Joint {
    matrix: Mat3A,
    translation: Vec3A,
    /// Inverse transpose: normals stay perpendicular under non-uniform scale.
    normal_matrix: Mat3A,
}

impl Joint {
    fn of(world_from_bind: &DAffine3, centre: DVec3, anchor_world: DVec3) -> Joint {
        let matrix = world_from_bind.matrix3;
        Joint {
            matrix: matrix.as_mat3().into(),
            translation: (world_from_bind.transform_point3(centre) - anchor_world).as_vec3a(),
            normal_matrix: normal_matrix(matrix).as_mat3().into(),
        }
    }
}

/// The inverse transpose, up to a positive factor; the cofactors, which exist for singular matrices too, where it does not.
fn normal_matrix(matrix: DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let determinant = matrix.determinant();
    if determinant == 0.0 { cofactors } else { cofactors * (1.0 / determinant) }
}
