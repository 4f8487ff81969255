//! From a file's vertex arrays to a [`Mesh`]: faulty triangles dropped, vertices re-centred, normals completed.

use glam::{DVec3, Vec3};

use super::Warnings;
use crate::{Mesh, Vertex};

/// A coordinate past this (six times the distance to the Sun's neighbour Neptune, and its square still far inside of
/// f32) is a fault of the file, and treated like one that is not finite.
const MAX_COORDINATE_M: f64 = 1e15;

/// How normals are made where the file has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MissingNormals {
    /// A face's own: each triangle gets its own vertices (glTF 2.0, 3.7.2.1).
    Flat,
    /// Mean of the faces around a vertex, weighted by their areas.
    Smooth,
}

/// Triangles as a file has them.
#[derive(Debug, Clone)]
pub(super) struct Geometry {
    /// In file units, in the space of the mesh's node.
    pub positions: Vec<DVec3>,
    /// As many as positions.
    pub normals: Option<Vec<[f32; 3]>>,
    /// As many as positions.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// See [`Mesh::second_uvs`]; as many as positions.
    pub second_uvs: Option<Vec<[f32; 2]>>,
    /// As many as positions.
    pub colours: Option<Vec<[u8; 4]>>,
    /// Three a triangle, all in range.
    pub triangles: Vec<[u32; 3]>,
    /// Index into the scene's materials.
    pub material: u32,
}

/// What [`Geometry::build`] makes.
#[derive(Debug, Clone)]
pub(super) struct Built {
    /// Relative to `centre`.
    pub mesh: Mesh,
    /// In the file's mesh space; `file_from_mesh` is the translation by it.
    pub centre: DVec3,
    /// For each vertex of the mesh, which of the file's it is.
    pub sources: Vec<u32>,
}

/// How [`Geometry::build`] treats its triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct BuildOptions {
    /// What to do without normals.
    pub missing_normals: MissingNormals,
    /// Whether triangles without area are kept: they may have some once they deform.
    pub keep_flat_triangles: bool,
}

impl Geometry {
    /// Builds the mesh. `at` names it in warnings. `None` where no triangle is left.
    pub fn build(mut self, at: &str, options: BuildOptions, warnings: &mut Warnings) -> Option<Built> {
        self.drop_faulty_triangles(at, options.keep_flat_triangles, warnings);
        if self.triangles.is_empty() {
            return None;
        }
        let file_normals = self.normals.take().map(|normals| self.mend_normals(normals, at, warnings));
        let smooth = match (&file_normals, options.missing_normals) {
            (None, MissingNormals::Smooth) => Some(self.smooth_normals()),
            _ => None,
        };
        let centre = self.centre();
        let mut builder = Builder { geometry: &self, centre, vertices: Vec::new(), sources: Vec::new() };
        let indices = match file_normals.as_ref().or(smooth.as_ref()) {
            Some(normals) => builder.shared(normals),
            None => builder.flat(),
        };
        let Builder { vertices, sources, .. } = builder;
        let bounds = bounds_of(&vertices);
        let second_uvs = self
            .second_uvs
            .as_ref()
            .map_or(Vec::new(), |uvs| sources.iter().map(|&source| finite(uvs[source as usize])).collect());
        Some(Built { mesh: Mesh { vertices, second_uvs, indices, material: self.material, bounds }, centre, sources })
    }

    fn drop_faulty_triangles(&mut self, at: &str, keep_flat: bool, warnings: &mut Warnings) {
        let positions = &self.positions;
        let usable = |index: u32| is_usable(positions[index as usize]);
        let total = self.triangles.len();
        self.triangles.retain(|triangle| triangle.iter().all(|&index| usable(index)));
        let finite = self.triangles.len();
        self.triangles.retain(|&[a, b, c]| {
            a != b && b != c && c != a && (keep_flat || face(positions, [a, b, c]) != DVec3::ZERO)
        });
        warnings.tally(at, total - finite, "triangles with a position that is not finite are dropped");
        warnings.tally(at, finite - self.triangles.len(), "degenerate triangles (no area) are dropped");
    }

    /// Unit normals: those that the file has, or the faces' mean where one is no direction.
    fn mend_normals(&self, mut normals: Vec<[f32; 3]>, at: &str, warnings: &mut Warnings) -> Vec<[f32; 3]> {
        /// Quantized normals are off by less; what is further off was never normalized.
        const UNIT_TOLERANCE: f32 = 0.1;
        let (mut absent, mut scaled) = (0_usize, 0_usize);
        let mut faces = None;
        for (index, normal) in normals.iter_mut().enumerate() {
            let v = Vec3::from(*normal);
            let length = v.length();
            // Not 0. The squares of an f32 vanish before, where the length is some 1e-23.
            if length.is_finite() && length > f32::MIN_POSITIVE {
                scaled += usize::from((length - 1.0).abs() > UNIT_TOLERANCE);
                *normal = (v / length).into();
            } else {
                absent += 1;
                *normal = faces.get_or_insert_with(|| self.smooth_normals())[index];
            }
        }
        warnings.tally(at, absent, "normals without a direction are replaced by those of the faces");
        warnings.tally(at, scaled, "normals that are not of unit length are normalized");
        normals
    }

    /// Area-weighted mean of the faces at each vertex.
    fn smooth_normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for &triangle in &self.triangles {
            let normal = face(&self.positions, triangle);
            for index in triangle {
                sums[index as usize] += normal;
            }
        }
        sums.into_iter().map(|sum| sum.normalize_or(DVec3::Y).as_vec3().into()).collect()
    }

    /// Middle of the used vertices, rounded to a grid so coarse that taking it from f32 coordinates stays exact.
    fn centre(&self) -> DVec3 {
        let mut bounds = crate::Bounds::EMPTY;
        for index in self.triangles.iter().flatten() {
            bounds.include(self.positions[*index as usize]);
        }
        let radius = bounds.radius_m();
        if radius == 0.0 {
            return bounds.centre();
        }
        /// An eighth of the radius: the mesh is off its centre by a sixteenth at most.
        const GRID_PER_RADIUS: f64 = 8.0;
        let step = (radius / GRID_PER_RADIUS).log2().floor().exp2();
        (bounds.centre() / step).round() * step
    }
}

/// Whether a place is one: finite, and not past [`MAX_COORDINATE_M`].
pub(super) fn is_usable(place: DVec3) -> bool {
    place.is_finite() && place.abs().max_element() <= MAX_COORDINATE_M
}

/// Twice the area, along the normal.
fn face(positions: &[DVec3], [a, b, c]: [u32; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|index| positions[index as usize]);
    (b - a).cross(c - a)
}

/// Smallest and largest corner of some vertices.
pub(super) fn bounds_of(vertices: &[Vertex]) -> [[f32; 3]; 2] {
    let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    for vertex in vertices {
        let p = Vec3::from(vertex.position);
        bounds = [bounds[0].min(p), bounds[1].max(p)];
    }
    bounds.map(Into::into)
}

fn finite(uv: [f32; 2]) -> [f32; 2] {
    uv.map(|x| if x.is_finite() { x } else { 0.0 })
}

struct Builder<'a> {
    geometry: &'a Geometry,
    centre: DVec3,
    vertices: Vec<Vertex>,
    sources: Vec<u32>,
}

impl Builder<'_> {
    /// Keeps shared vertices shared; leaves out those that no triangle uses.
    fn shared(&mut self, normals: &[[f32; 3]]) -> Vec<u32> {
        const UNUSED: u32 = u32::MAX;
        let mut new_index = vec![UNUSED; self.geometry.positions.len()];
        let geometry = self.geometry;
        let mut indices = Vec::with_capacity(geometry.triangles.len() * 3);
        for &source in geometry.triangles.iter().flatten() {
            let slot = &mut new_index[source as usize];
            if *slot == UNUSED {
                *slot = self.vertices.len() as u32;
                self.push(source, normals[source as usize]);
            }
            indices.push(new_index[source as usize]);
        }
        indices
    }

    /// Three vertices of its own for each triangle.
    fn flat(&mut self) -> Vec<u32> {
        let geometry = self.geometry;
        for &triangle in &geometry.triangles {
            let normal = face(&geometry.positions, triangle).normalize_or(DVec3::Y).as_vec3().into();
            for source in triangle {
                self.push(source, normal);
            }
        }
        (0..self.vertices.len() as u32).collect()
    }

    fn push(&mut self, source: u32, normal: [f32; 3]) {
        let index = source as usize;
        let uv = self.geometry.uvs.as_ref().map_or([0.0; 2], |uvs| uvs[index]);
        self.vertices.push(Vertex {
            position: (self.geometry.positions[index] - self.centre).as_vec3().into(),
            normal,
            uv: finite(uv),
            colour: self.geometry.colours.as_ref().map_or([255; 4], |colours| colours[index]),
        });
        self.sources.push(source);
    }
}
