//! Rectangles that emit light, as lights with an area.

use glam::{DVec3, Vec3};

use crate::Mesh;

/// How far from planes, sides and right angles a rectangle may be, as a share of its sides: what positions of 16 bits leave.
const SLACK: f64 = 1e-3;

/// A rectangle in the space of its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    pub middle: DVec3,
    /// From the middle to the middles of two sides; their cross product points to the front.
    pub half: [DVec3; 2],
}

/// The rectangle that a mesh is, if it is one: two triangles with a side in common, which face the same way.
pub(super) fn rectangle(mesh: &Mesh) -> Option<Rectangle> {
    let [a, b, c, d, e, f] = *mesh.indices.as_slice() else { return None };
    let at = |index: u32| Some(Vec3::from(mesh.vertices.get(index as usize)?.position).as_dvec3());
    let (first, second) = ([at(a)?, at(b)?, at(c)?], [at(d)?, at(e)?, at(f)?]);
    let size = first[0].distance(first[1]) + first[1].distance(first[2]);
    let is_same = |p: DVec3, q: DVec3| p.distance(q) <= SLACK * size;
    let other = second.into_iter().find(|p| !first.iter().any(|q| is_same(*p, *q)))?;
    // The corner across the common side.
    let (index, across) = first.into_iter().enumerate().find(|(_, p)| !second.iter().any(|q| is_same(*p, *q)))?;
    let (next, last) = (first[(index + 1) % 3], first[(index + 2) % 3]);
    let (u, v) = ((next - across) / 2.0, (last - across) / 2.0);
    let is_parallelogram = is_same(across + 2.0 * (u + v), other);
    let has_right_angles = u.dot(v).abs() <= SLACK * u.length() * v.length();
    let normal = u.cross(v);
    let faces_alike = (second[1] - second[0]).cross(second[2] - second[0]).dot(normal) > 0.0;
    let is_flat = normal.length() > 0.0;
    (is_parallelogram && has_right_angles && faces_alike && is_flat)
        .then_some(Rectangle { middle: across + u + v, half: [u, v] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Vertex;

    fn mesh(corners: &[[f32; 3]], indices: &[u32]) -> Mesh {
        let vertices = corners.iter().map(|&position| Vertex { position, ..bytemuck::Zeroable::zeroed() }).collect();
        Mesh { vertices, indices: indices.to_vec(), ..Mesh::default() }
    }

    #[test]
    fn two_triangles_are_a_rectangle_or_not() {
        let corners = [[1.0, 0.0, 2.0], [1.0, 0.0, 6.0], [3.0, 0.0, 6.0], [3.0, 0.0, 2.0]];
        for indices in [[0, 1, 2, 0, 2, 3], [1, 2, 0, 3, 0, 2], [2, 3, 1, 1, 3, 0]] {
            let found = rectangle(&mesh(&corners, &indices)).expect("a rectangle");
            assert_eq!(found.middle, DVec3::new(2.0, 0.0, 4.0));
            let mut lengths = found.half.map(|half| half.length());
            lengths.sort_by(f64::total_cmp);
            assert_eq!(lengths, [1.0, 2.0]);
            assert!(found.half[0].cross(found.half[1]).y > 0.0, "the front is up");
        }
        let skewed = [[1.0, 0.0, 2.0], [1.5, 0.0, 6.0], [3.5, 0.0, 6.0], [3.0, 0.0, 2.0]];
        assert_eq!(rectangle(&mesh(&skewed, &[0, 1, 2, 0, 2, 3])), None);
        let bent = [[1.0, 0.0, 2.0], [1.0, 0.0, 6.0], [3.0, 0.0, 6.0], [3.0, 0.5, 2.0]];
        assert_eq!(rectangle(&mesh(&bent, &[0, 1, 2, 0, 2, 3])), None);
        assert_eq!(rectangle(&mesh(&corners, &[0, 1, 2, 0, 3, 2])), None, "one faces down");
        assert_eq!(rectangle(&mesh(&corners, &[0, 1, 2])), None);
        assert_eq!(rectangle(&mesh(&[[0.0; 3]; 4], &[0, 1, 2, 0, 2, 3])), None, "no extent");
        assert_eq!(rectangle(&mesh(&corners, &[0, 1, 2, 0, 2, 9])), None, "an index beyond");
    }
}
