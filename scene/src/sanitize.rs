//! Takes out of a mesh what must not reach a GPU: triangles that are not finite, have no area or point past the vertices.
//!
//! Vertices stay where they are in the list, because skins, morph targets and deformations refer to them by number.

use std::fmt;

use glam::Vec3;

use crate::model::{Mesh, Vertex};

/// What [`sanitize`] took out or mended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Triangles with an index past the last vertex, and indices left over after the last whole triangle.
    pub out_of_range: usize,
    /// Triangles with a corner that is infinite or not a number.
    pub not_finite: usize,
    /// Triangles without area.
    pub no_area: usize,
    /// Vertices that kept their place but whose normal or texture coordinate was replaced.
    pub mended_vertices: usize,
}

impl Dropped {
    /// Triangles taken out.
    pub fn triangles(&self) -> usize {
        self.out_of_range + self.not_finite + self.no_area
    }

    /// Whether the mesh was good as it was.
    pub fn is_nothing(&self) -> bool {
        *self == Dropped::default()
    }
}

impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            (self.out_of_range, "triangles with indices out of range dropped"),
            (self.not_finite, "triangles with corners that are not finite dropped"),
            (self.no_area, "triangles without area dropped"),
            (self.mended_vertices, "vertices with unusable normals or texture coordinates mended"),
        ];
        let said: Vec<String> = parts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
        f.write_str(if said.is_empty() { "nothing dropped" } else { "" })?;
        f.write_str(&said.join(", "))
    }
}

/// Drops unusable triangles, mends unusable normals (with the triangle's own) and texture coordinates, gives vertices
/// without a finite place one that no triangle shows, and sets the bounds to what is left.
pub fn sanitize(mesh: &mut Mesh) -> Dropped {
    let mut dropped =
        Dropped { out_of_range: usize::from(!mesh.indices.len().is_multiple_of(3)), ..Dropped::default() };
    let mut kept = Vec::with_capacity(mesh.indices.len());
    let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    for triangle in mesh.indices.chunks_exact(3) {
        let corner = |k: usize| mesh.vertices.get(triangle[k] as usize).map(|v| Vec3::from(v.position));
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
            dropped.out_of_range += 1;
            continue;
        };
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            dropped.not_finite += 1;
        } else if !has_area(a, b, c) {
            dropped.no_area += 1;
        } else {
            kept.extend_from_slice(triangle);
            bounds = [bounds[0].min(a).min(b).min(c), bounds[1].max(a).max(b).max(c)];
        }
    }
    mesh.indices = kept;
    mesh.bounds = if mesh.indices.is_empty() { [[0.0; 3]; 2] } else { bounds.map(|p| p.to_array()) };
    dropped.mended_vertices = mend(mesh);
    dropped
}

/// In f64, where products of f32 differences neither vanish nor overflow.
fn has_area(a: Vec3, b: Vec3, c: Vec3) -> bool {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a).length_squared() > 0.0
}

fn mend(mesh: &mut Mesh) -> usize {
    let usable = |vertex: &Vertex| {
        let normal = Vec3::from(vertex.normal);
        // Normals of 8 bits are off by half a step of 1/127 along each axis, together by 0.7 % of their length.
        normal.is_finite() && (normal.length() - 1.0).abs() < 0.01 && vertex.uv.iter().all(|x| x.is_finite())
    };
    let hidden = mesh.bounds[0];
    let mut flat = vec![Vec3::ZERO; mesh.vertices.len()];
    if !mesh.vertices.iter().all(usable) {
        for triangle in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.vertices[triangle[k] as usize].position).as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            triangle.iter().for_each(|&i| flat[i as usize] += normal);
        }
    }
    let mut mended = 0;
    for (vertex, flat) in mesh.vertices.iter_mut().zip(flat) {
        if !Vec3::from(vertex.position).is_finite() {
            vertex.position = hidden;
        }
        if usable(vertex) {
            continue;
        }
        mended += 1;
        vertex.uv = vertex.uv.map(|x| if x.is_finite() { x } else { 0.0 });
        let normal = Vec3::from(vertex.normal);
        // In f64: squares of f32 may vanish or overflow.
        let unit = |n: Vec3| if n.is_finite() { n.as_dvec3().normalize_or_zero().as_vec3() } else { Vec3::ZERO };
        let normal = [unit(normal), unit(flat), Vec3::Y].into_iter().find(|n| *n != Vec3::ZERO).unwrap_or(Vec3::Y);
        vertex.normal = normal.to_array();
    }
    mended
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mesh(positions: &[[f32; 3]], indices: &[u32]) -> Mesh {
        let vertex =
            |&position: &[f32; 3]| Vertex { position, normal: [0.0, 1.0, 0.0], uv: [0.0; 2], colour: [255; 4] };
        Mesh { vertices: positions.iter().map(vertex).collect(), indices: indices.to_vec(), ..Mesh::default() }
    }

    #[test]
    fn drops_what_cannot_be_drawn_and_keeps_the_rest() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0], [f32::NAN, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let mut mesh = mesh(&positions, &[0, 1, 2, 0, 1, 3, 0, 1, 4, 1, 1, 2, 0, 1, 9, 2, 1, 0, 7]);
        let dropped = sanitize(&mut mesh);
        assert_eq!(dropped, Dropped { out_of_range: 2, not_finite: 1, no_area: 2, mended_vertices: 0 });
        assert_eq!(mesh.indices, [0, 1, 2, 2, 1, 0]);
        assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 0.0, 2.0]]);
        assert_eq!(mesh.vertices.len(), positions.len());
        assert!(dropped.to_string().contains("1 triangles with corners that are not finite"));
    }

    #[test]
    fn small_and_large_triangles_have_area() {
        for size in [1e-18f32, 1e-6, 1e4, 1e18] {
            let mut mesh = mesh(&[[0.0; 3], [size, 0.0, 0.0], [0.0, 0.0, size]], &[0, 2, 1]);
            assert!(sanitize(&mut mesh).is_nothing(), "{size}");
        }
    }

    #[test]
    fn normals_are_mended_from_the_triangle() {
        let mut mesh = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[0, 1, 2]);
        mesh.vertices[0].normal = [f32::NAN; 3];
        mesh.vertices[1].normal = [0.0, 0.0, 5.0];
        assert_eq!(sanitize(&mut mesh).mended_vertices, 2);
        assert_eq!(mesh.vertices[0].normal, [0.0, 0.0, 1.0]);
        assert_eq!(mesh.vertices[1].normal, [0.0, 0.0, 1.0]);
    }

    proptest! {
        #[test]
        fn nothing_unusable_is_left(
            floats in prop::collection::vec(prop::num::f32::ANY, 3..60),
            indices in prop::collection::vec(0u32..24, 0..60),
        ) {
            let positions: Vec<[f32; 3]> = floats.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
            let mut mesh = mesh(&positions, &indices);
            mesh.vertices[0].normal = positions[0];
            sanitize(&mut mesh);
            for vertex in &mesh.vertices {
                prop_assert!(vertex.position.iter().all(|x| x.is_finite()));
                prop_assert!((Vec3::from(vertex.normal).length() - 1.0).abs() < 0.02);
            }
            prop_assert!(mesh.indices.iter().all(|&i| (i as usize) < mesh.vertices.len()));
            prop_assert!(sanitize(&mut mesh).is_nothing());
        }
    }
}
