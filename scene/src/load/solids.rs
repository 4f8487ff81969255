//! Solids that stand for points and lines, which have no area to draw: small octahedra and thin prisms.
//!
//! A point becomes as large as it is far from its neighbours, so a dense cloud looks closed from where its points were
//! taken. Few points are marks that stand apart. A line becomes as wide as a pixel of a picture that shows all of them.

use glam::DVec3;

use super::geometry::{Geometry, is_usable};
use super::spacing::spacings;

/// Vertices of a solid.
const CORNERS: usize = 6;

/// Both solids are three corners below and three above: a prism, or, twisted, an octahedron.
const TRIANGLES: [[u32; 3]; 8] =
    [[0, 2, 1], [3, 4, 5], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]];

/// Corners of an octahedron in the order of [`TRIANGLES`]: each is opposite to the only one that it shares no edge with.
const OCTAHEDRON: [DVec3; CORNERS] = [DVec3::X, DVec3::Z, DVec3::Y, DVec3::NEG_Y, DVec3::NEG_X, DVec3::NEG_Z];

/// Seen along an axis an octahedron covers twice the square of its radius: at this share of the distance between points
/// as much as a cell of their grid.
const RADIUS_PER_SPACING: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// A stray point far from all others would be a boulder. Scanned clouds are a few times sparser far from the scanner.
const MAX_RADIUS_PER_MEDIAN: f64 = 4.0;
/// Few points are marks that stand apart, of the diagonal of their extent.
const MAX_RADIUS_PER_EXTENT: f64 = 0.1;
/// Of a point that is alone, in file units.
const LONE_RADIUS: f64 = 0.01;

/// Lines have the width of a pixel of a picture with so many along the diagonal of their extent.
const LINE_PICTURE_PX: f64 = 1000.0;

/// Triangles to draw.
#[derive(Debug)]
pub(super) struct Solids {
    /// Complete.
    pub geometry: Geometry,
    /// For each vertex, which of the file's it is; `None` where they are the file's.
    pub sources: Option<Vec<u32>>,
}

impl Solids {
    /// What needs no solid.
    pub fn of_triangles(geometry: Geometry) -> Solids {
        Solids { geometry, sources: None }
    }

    /// An octahedron for each of some vertices, those with a usable place. Normals are the vertices' own, if they have
    /// any, so that light falls on them as on the surface that they were taken from.
    pub fn of_points(geometry: &Geometry, vertices: &[u32]) -> Solids {
        let place = |vertex: u32| geometry.positions[vertex as usize];
        let vertices: Vec<u32> = vertices.iter().copied().filter(|&vertex| is_usable(place(vertex))).collect();
        let places: Vec<DVec3> = vertices.iter().map(|&vertex| place(vertex)).collect();
        let mut solids = Builder::new(geometry, vertices.len());
        for (&vertex, radius) in vertices.iter().zip(radii(&places)) {
            let own = geometry.normals.as_ref().map(|normals| normals[vertex as usize]);
            solids.add(OCTAHEDRON.map(|corner| Corner {
                source: vertex,
                offset: corner * radius,
                normal: own.unwrap_or(corner.as_vec3().into()),
            }));
        }
        solids.finish()
    }

    /// A prism along each line that has a length.
    pub fn of_lines(geometry: &Geometry, lines: &[[u32; 2]]) -> Solids {
        let place = |vertex: u32| geometry.positions[vertex as usize];
        let lines: Vec<[u32; 2]> =
            lines.iter().copied().filter(|line| line.iter().all(|&vertex| is_usable(place(vertex)))).collect();
        let mut bounds = crate::Bounds::EMPTY;
        lines.iter().flatten().for_each(|&vertex| bounds.include(place(vertex)));
        let radius = bounds.radius_m() / LINE_PICTURE_PX;
        let mut solids = Builder::new(geometry, lines.len());
        for &[from, to] in &lines {
            let Some(along) = (place(to) - place(from)).try_normalize() else { continue };
            let (u, v) = along.any_orthonormal_pair();
            let corner = |index: usize| {
                let (sin, cos) = (index as f64 * std::f64::consts::TAU / 3.0).sin_cos();
                let outward = cos * u + sin * v;
                Corner {
                    source: if index < 3 { from } else { to },
                    offset: outward * radius,
                    normal: outward.as_vec3().into(),
                }
            };
            solids.add(std::array::from_fn(corner));
        }
        solids.finish()
    }
}

/// Of each point's octahedron.
fn radii(places: &[DVec3]) -> Vec<f64> {
    let spacings = spacings(places);
    let mut apart: Vec<f64> = spacings.iter().copied().filter(|spacing| *spacing > 0.0).collect();
    let middle = apart.len() / 2;
    let median = if apart.is_empty() {
        LONE_RADIUS / RADIUS_PER_SPACING
    } else {
        *apart.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let mut bounds = crate::Bounds::EMPTY;
    places.iter().for_each(|&place| bounds.include(place));
    let extent = 2.0 * bounds.radius_m();
    let largest = if extent > 0.0 { MAX_RADIUS_PER_EXTENT * extent } else { LONE_RADIUS };
    let spacing = |spacing: f64| if spacing > 0.0 { spacing.min(MAX_RADIUS_PER_MEDIAN * median) } else { median };
    spacings.into_iter().map(|own| (RADIUS_PER_SPACING * spacing(own)).min(largest)).collect()
}

struct Corner {
    source: u32,
    offset: DVec3,
    normal: [f32; 3],
}

struct Builder<'a> {
    from: &'a Geometry,
    solids: Geometry,
    sources: Vec<u32>,
}

impl Builder<'_> {
    fn new(from: &Geometry, count: usize) -> Builder<'_> {
        let solids = Geometry {
            positions: Vec::with_capacity(count * CORNERS),
            normals: Some(Vec::with_capacity(count * CORNERS)),
            uvs: None,
            second_uvs: None,
            colours: None,
            triangles: Vec::with_capacity(count * TRIANGLES.len()),
            material: from.material,
        };
        Builder { from, solids, sources: Vec::with_capacity(count * CORNERS) }
    }

    fn add(&mut self, corners: [Corner; CORNERS]) {
        let first = self.sources.len() as u32;
        for Corner { source, offset, normal } in corners {
            self.solids.positions.push(self.from.positions[source as usize] + offset);
            self.solids.normals.get_or_insert_default().push(normal);
            self.sources.push(source);
        }
        self.solids.triangles.extend(TRIANGLES.map(|triangle| triangle.map(|corner| first + corner)));
    }

    fn finish(self) -> Solids {
        let Builder { from, mut solids, sources } = self;
        let pick = |index: &u32| *index as usize;
        let picked = |uvs: &Vec<[f32; 2]>| sources.iter().map(|index| uvs[pick(index)]).collect();
        solids.uvs = from.uvs.as_ref().map(picked);
        solids.second_uvs = from.second_uvs.as_ref().map(picked);
        solids.colours =
            from.colours.as_ref().map(|colours| sources.iter().map(|index| colours[pick(index)]).collect());
        Solids { geometry: solids, sources: Some(sources) }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::closed::is_closed;
    use super::*;

    fn geometry(positions: &[DVec3]) -> Geometry {
        Geometry {
            positions: positions.to_vec(),
            normals: None,
            uvs: None,
            second_uvs: None,
            colours: None,
            triangles: Vec::new(),
            material: 0,
        }
    }

    /// By the divergence theorem; negative where faces look inward.
    fn volume(geometry: &Geometry) -> f64 {
        let corner = |index: u32| geometry.positions[index as usize];
        geometry.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
    }

    fn faces_look_where_normals_point(geometry: &Geometry) -> bool {
        let normals = geometry.normals.as_ref().unwrap();
        geometry.triangles.iter().skip(2).all(|triangle| {
            let [a, b, c] = triangle.map(|index| geometry.positions[index as usize]);
            let face = (b - a).cross(c - a).as_vec3();
            triangle.iter().all(|&index| face.dot(Vec3::from(normals[index as usize])) > 0.0)
        })
    }

    #[test]
    fn a_point_is_a_closed_octahedron_as_large_as_the_grid_that_it_is_of() {
        let grid: Vec<DVec3> = (0..49).map(|i| DVec3::new(f64::from(i % 7), f64::from(i / 7), 9.0)).collect();
        let solids = Solids::of_points(&geometry(&grid), &[24]);
        assert!((volume(&solids.geometry) - 4.0 / 3.0 * LONE_RADIUS.powi(3)).abs() < 1e-12, "it is alone");
        assert_eq!(solids.sources, Some(vec![24; 6]));
        let solids = Solids::of_points(&geometry(&grid), &(0..49).collect::<Vec<u32>>());
        let middle = Geometry {
            positions: solids.geometry.positions[24 * 6..25 * 6].to_vec(),
            normals: solids.geometry.normals.map(|normals| normals[24 * 6..25 * 6].to_vec()),
            triangles: TRIANGLES.to_vec(),
            ..geometry(&[])
        };
        assert!(is_closed(&middle.positions, &middle.triangles) && faces_look_where_normals_point(&middle));
        assert!((volume(&middle) - 4.0 / 3.0 * RADIUS_PER_SPACING.powi(3)).abs() < 1e-12, "{}", volume(&middle));
    }

    #[test]
    fn stray_and_repeated_points_are_as_large_as_others() {
        let mut places: Vec<DVec3> = (0..20).map(|i| DVec3::X * f64::from(i)).collect();
        places.push(DVec3::Y * 1e6);
        places.extend([DVec3::Z * 3.0; 6]);
        let radii = radii(&places);
        let median = radii[10];
        assert!((radii[20] / median - MAX_RADIUS_PER_MEDIAN).abs() < 1e-9, "{radii:?}");
        assert!((radii[22] / median - 1.0).abs() < 1e-9, "{radii:?}");
        let two = super::radii(&[DVec3::ZERO, DVec3::X * 5.0]);
        assert_eq!(two, [0.5; 2]);
    }

    #[test]
    fn a_line_is_a_closed_prism() {
        let places = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-2.0, 6.0, 3.0)];
        let solids = Solids::of_lines(&geometry(&places), &[[0, 1], [1, 1]]);
        let radius = 2.5 / LINE_PICTURE_PX;
        let expected = 5.0 * radius * radius * 3.0_f64.sqrt() * 0.75;
        assert!((volume(&solids.geometry) - expected).abs() < 1e-9 * expected.max(1.0));
        assert!(is_closed(&solids.geometry.positions, &solids.geometry.triangles));
        assert!(faces_look_where_normals_point(&solids.geometry));
        assert_eq!(solids.sources, Some(vec![0, 0, 0, 1, 1, 1]));
    }
}
