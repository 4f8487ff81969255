//! One primitive of a mesh: its triangles, or the solids that stand for its points and lines, with morph targets and skin
//! influences.

use glam::DVec3;

use super::attributes::{AttributeReader, Influences, MorphTarget, Place};
use super::document;
use super::draco::{self, Decompressed};
use crate::load::geometry::{BuildOptions, Built, Geometry, MissingNormals};
use crate::load::solids::Solids;
use crate::load::{LoadError, Warnings};

/// A primitive, built: what instances of it share.
#[derive(Debug)]
pub(super) struct Primitive {
    /// Re-centred, completed, in rest shape without morph targets.
    pub built: Built,
    /// Deltas by target, then by vertex of the built mesh.
    pub targets: Vec<MorphTarget>,
    /// By vertex of the built mesh; `None` without joints.
    pub influences: Option<Influences>,
    /// Whether normals are the faces' own, and must follow them.
    pub flat: bool,
}

impl Primitive {
    /// Reads one. `None` with a warning where it has nothing to draw. `skin_joints` is how many joints its skins have
    /// at least; `None` where no node skins it.
    pub fn read(
        source: &document::Primitive,
        at: &str,
        place: Place<'_>,
        skin_joints: Option<usize>,
        warnings: &mut Warnings,
    ) -> Result<Option<Primitive>, LoadError> {
        let form = Form::of(source.mode, at)?;
        let compressed = decompress(source, at, place, warnings)?;
        let reader = AttributeReader { attributes: &source.attributes, compressed: compressed.as_ref(), at, place };
        let Some(positions) = reader.positions()? else {
            warnings.add(format!("{at}: has no POSITION and is left out"));
            return Ok(None);
        };
        let count = positions.len();
        if let Some(vertices) = compressed.as_ref().map(Decompressed::vertices).filter(|&vertices| vertices != count) {
            // Positions of an accessor go with triangles of the stream where that has none.
            let fault = format!("the stream has {vertices} vertices, POSITION has {count}");
            return Err(LoadError::malformed(format!("{at}.extensions.KHR_draco_mesh_compression"), fault));
        }
        let material = match source.material {
            Some(index) if index < place.document.materials.len() => index,
            Some(index) => {
                let known = place.document.materials.len();
                return Err(LoadError::malformed(at, format!("material {index} does not exist, there are {known}")));
            }
            None => place.document.materials.len(),
        };
        let [first_uvs, second_uvs] = place.uv_sources[material];
        let geometry = Geometry {
            positions: positions.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            normals: reader.floats::<3>("NORMAL", count)?,
            uvs: reader.uvs(first_uvs, count, warnings)?,
            second_uvs: reader.uvs(second_uvs, count, warnings)?,
            colours: reader.colours(count)?,
            triangles: Vec::new(),
            material: material as u32,
        };
        let solids = match compressed.as_ref().map(|stream| stream.triangles.clone()) {
            Some(triangles) => Solids::of_triangles(Geometry { triangles, ..geometry }),
            None => form.solids(geometry, &reader.indices(source.indices, count)?, at, place.solid_step, warnings),
        };
        let targets = reader.targets(&source.targets, count)?;
        let influences = match skin_joints {
            Some(joints) => reader.influences(count, joints, warnings)?,
            None => None,
        };
        Ok(Primitive::build(solids, targets, influences, at, warnings))
    }

    fn build(
        solids: Solids,
        targets: Vec<MorphTarget>,
        influences: Option<Influences>,
        at: &str,
        warnings: &mut Warnings,
    ) -> Option<Primitive> {
        let flat = solids.geometry.normals.is_none();
        let deforms = !targets.is_empty() || influences.is_some();
        let options = BuildOptions { missing_normals: MissingNormals::Flat, keep_flat_triangles: deforms };
        let mut built = solids.geometry.build(at, options, warnings)?;
        if let Some(points) = &solids.sources {
            built.sources.iter_mut().for_each(|source| *source = points[*source as usize]);
        }
        Some(Primitive {
            targets: targets.into_iter().map(|target| target.of_vertices(&built.sources)).collect(),
            influences: influences.map(|influences| influences.of_vertices(&built.sources)),
            built,
            flat,
        })
    }
}

/// What a primitive's stream has, where it has one. A damaged one is an error, unless accessors have the same in plain form.
fn decompress<'a>(
    source: &'a document::Primitive,
    at: &str,
    place: Place<'_>,
    warnings: &mut Warnings,
) -> Result<Option<Decompressed<'a>>, LoadError> {
    let position = source.attributes.get("POSITION").and_then(|&index| place.document.accessors.get(index));
    match draco::decompress(source, place.document, place.accessors.buffers()).transpose() {
        Ok(decompressed) => Ok(decompressed),
        Err(fault) => {
            let at = format!("{at}.extensions.KHR_draco_mesh_compression");
            if position.is_none_or(|accessor| accessor.buffer_view.is_none()) {
                return Err(LoadError::malformed(at, fault));
            }
            warnings.add(format!("{at}: {fault}; the uncompressed form is shown"));
            Ok(None)
        }
    }
}

/// What indices form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Points,
    Lines,
    LineLoop,
    LineStrip,
    Triangles,
    TriangleStrip,
    TriangleFan,
}

impl Form {
    fn of(mode: Option<u32>, at: &str) -> Result<Form, LoadError> {
        Ok(match mode {
            Some(0) => Form::Points,
            Some(1) => Form::Lines,
            Some(2) => Form::LineLoop,
            Some(3) => Form::LineStrip,
            None | Some(4) => Form::Triangles,
            Some(5) => Form::TriangleStrip,
            Some(6) => Form::TriangleFan,
            Some(mode) => return Err(LoadError::malformed(format!("{at}.mode"), format!("unknown mode {mode}"))),
        })
    }

    /// Triangles as they are; points and lines, of which one of `step` is drawn, as solids.
    fn solids(self, geometry: Geometry, indices: &[u32], at: &str, step: usize, warnings: &mut Warnings) -> Solids {
        let drawn = |what: &str| match step {
            1 => format!("{at}: {what}"),
            _ => format!("{at}: {what}, one of every {step}"),
        };
        match self {
            Form::Points => {
                warnings.add(drawn("points are drawn as small octahedra"));
                let points: Vec<u32> = indices.iter().copied().step_by(step).collect();
                Solids::of_points(&geometry, &points)
            }
            Form::Lines | Form::LineLoop | Form::LineStrip => {
                warnings.add(drawn("lines are drawn as thin prisms"));
                let lines: Vec<[u32; 2]> = self.lines(indices).into_iter().step_by(step).collect();
                Solids::of_lines(&geometry, &lines)
            }
            _ => Solids::of_triangles(Geometry { triangles: self.triangles(indices, at, warnings), ..geometry }),
        }
    }

    fn lines(self, indices: &[u32]) -> Vec<[u32; 2]> {
        match self {
            Form::Lines => indices.as_chunks::<2>().0.to_vec(),
            _ => {
                let close = (self == Form::LineLoop).then(|| Some([*indices.last()?, *indices.first()?])).flatten();
                indices.windows(2).map(|pair| [pair[0], pair[1]]).chain(close).collect()
            }
        }
    }

    /// glTF 2.0, 3.7.2.1: the order of vertices that keeps a strip's and a fan's triangles facing one way.
    fn triangles(self, indices: &[u32], at: &str, warnings: &mut Warnings) -> Vec<[u32; 3]> {
        match self {
            Form::TriangleStrip => {
                let ordered = |(i, w): (usize, &[u32])| [w[0], w[1 + i % 2], w[2 - i % 2]];
                indices.windows(3).enumerate().map(ordered).collect()
            }
            Form::TriangleFan => match indices.split_first() {
                Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).collect(),
                None => Vec::new(),
            },
            _ => {
                let (triangles, rest) = indices.as_chunks::<3>();
                if !rest.is_empty() {
                    warnings.add(format!("{at}: {} indices past the last whole triangle are ignored", rest.len()));
                }
                triangles.to_vec()
            }
        }
    }
}
