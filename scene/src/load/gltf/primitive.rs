//! One primitive of a mesh: its vertex attributes, triangles, morph targets and skin influences.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::accessor::{Accessors, Count};
use super::document::{self, Document};
use super::material::UvSource;
use crate::load::geometry::{BuildOptions, Built, Geometry, MissingNormals};
use crate::load::{LoadError, LoadLimits, Warnings};

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

/// What one target at weight 1 adds. Either may be empty: nothing is added.
#[derive(Debug, Clone, Default)]
pub(super) struct MorphTarget {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
}

/// Joints and weights of each vertex, summing to 1.
#[derive(Debug, Clone)]
pub(super) struct Influences {
    /// Entries a vertex: four for each attribute set.
    pub per_vertex: usize,
    /// Index into the skin's joints, and weight.
    pub entries: Vec<(u32, f32)>,
}

/// Attribute sets of four influences that are used. Few files have two; each more would cost time at every frame.
const MAX_JOINT_SETS: usize = 2;

/// Where a primitive stands in its document.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub document: &'a Document,
    pub accessors: Accessors<'a>,
    pub limits: &'a LoadLimits,
    /// By material.
    pub uv_sources: &'a [Option<UvSource>],
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
        let Some(topology) = Topology::of(source.mode, at, warnings)? else { return Ok(None) };
        let Some(&positions) = source.attributes.get("POSITION") else {
            warnings.add(format!("{at}: has no POSITION and is left out"));
            return Ok(None);
        };
        let reader = AttributeReader { attributes: &source.attributes, at, place };
        let positions =
            place.accessors.floats::<3>(positions, &format!("{at}.POSITION"), Count::AtMost(place.limits.vertices))?;
        let count = positions.len();
        let triangles = topology.triangles(reader.indices(source.indices, count)?, at, warnings);
        let material = match source.material {
            Some(index) if index < place.document.materials.len() => index,
            Some(index) => {
                let known = place.document.materials.len();
                return Err(LoadError::malformed(at, format!("material {index} does not exist, there are {known}")));
            }
            None => place.document.materials.len(),
        };
        let uv_source = place.uv_sources[material];
        let geometry = Geometry {
            positions: positions.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            normals: reader.floats::<3>("NORMAL", count)?,
            uvs: reader.uvs(uv_source, count, warnings)?,
            colours: reader.colours(count)?,
            triangles,
            material: material as u32,
        };
        let flat = geometry.normals.is_none();
        let targets = reader.targets(&source.targets, count)?;
        let influences = match skin_joints {
            Some(joints) => reader.influences(count, joints, warnings)?,
            None => None,
        };
        let deforms = !targets.is_empty() || influences.is_some();
        let options = BuildOptions { missing_normals: MissingNormals::Flat, keep_flat_triangles: deforms };
        let Some(built) = geometry.build(at, options, warnings) else { return Ok(None) };
        Ok(Some(Primitive {
            targets: targets.into_iter().map(|target| target.of_vertices(&built.sources)).collect(),
            influences: influences.map(|influences| influences.of_vertices(&built.sources)),
            built,
            flat,
        }))
    }
}

impl MorphTarget {
    fn of_vertices(self, sources: &[u32]) -> MorphTarget {
        let pick = |deltas: Vec<Vec3>| match deltas.is_empty() {
            true => deltas,
            false => sources.iter().map(|&source| deltas[source as usize]).collect(),
        };
        MorphTarget { positions: pick(self.positions), normals: pick(self.normals) }
    }
}

impl Influences {
    fn of_vertices(self, sources: &[u32]) -> Influences {
        let n = self.per_vertex;
        let entries = sources.iter().flat_map(|&source| &self.entries[source as usize * n..(source as usize + 1) * n]);
        Influences { per_vertex: n, entries: entries.copied().collect() }
    }
}

/// How indices form triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Topology {
    List,
    Strip,
    Fan,
}

impl Topology {
    /// `None` with a warning for points and lines.
    fn of(mode: Option<u32>, at: &str, warnings: &mut Warnings) -> Result<Option<Topology>, LoadError> {
        let dropped = match mode {
            None | Some(4) => return Ok(Some(Topology::List)),
            Some(5) => return Ok(Some(Topology::Strip)),
            Some(6) => return Ok(Some(Topology::Fan)),
            Some(0) => "points",
            Some(1..=3) => "lines",
            Some(mode) => return Err(LoadError::malformed(format!("{at}.mode"), format!("unknown mode {mode}"))),
        };
        warnings.add(format!("{at}: {dropped} are not drawn"));
        Ok(None)
    }

    /// glTF 2.0, 3.7.2.1: the order of vertices that keeps a strip's and a fan's triangles facing one way.
    fn triangles(self, indices: Vec<u32>, at: &str, warnings: &mut Warnings) -> Vec<[u32; 3]> {
        match self {
            Topology::List => {
                let (triangles, rest) = indices.as_chunks::<3>();
                if !rest.is_empty() {
                    warnings.add(format!("{at}: {} indices past the last whole triangle are ignored", rest.len()));
                }
                triangles.to_vec()
            }
            Topology::Strip => {
                let ordered = |(i, w): (usize, &[u32])| [w[0], w[1 + i % 2], w[2 - i % 2]];
                indices.windows(3).enumerate().map(ordered).collect()
            }
            Topology::Fan => match indices.split_first() {
                Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).collect(),
                None => Vec::new(),
            },
        }
    }
}

struct AttributeReader<'a> {
    attributes: &'a BTreeMap<String, usize>,
    at: &'a str,
    place: Place<'a>,
}

impl AttributeReader<'_> {
    fn floats<const N: usize>(&self, name: &str, count: usize) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let Some(&index) = self.attributes.get(name) else { return Ok(None) };
        self.place.accessors.floats(index, &format!("{}.{name}", self.at), Count::Exactly(count)).map(Some)
    }

    fn indices(&self, accessor: Option<usize>, vertices: usize) -> Result<Vec<u32>, LoadError> {
        let Some(accessor) = accessor else { return Ok((0..vertices as u32).collect()) };
        let at = format!("{}.indices", self.at);
        let limit = self.place.limits.triangles.saturating_mul(3);
        let indices = self.place.accessors.integers::<1>(accessor, &at, Count::AtMost(limit))?;
        match indices.iter().find(|index| index[0] as usize >= vertices) {
            Some([index]) => Err(LoadError::malformed(at, format!("index {index} is past the {vertices} vertices"))),
            None => Ok(indices.into_flattened()),
        }
    }

    fn uvs(
        &self,
        source: Option<UvSource>,
        count: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<[f32; 2]>>, LoadError> {
        let Some(source) = source else { return Ok(None) };
        let name = format!("TEXCOORD_{}", source.set);
        let uvs = self.floats::<2>(&name, count)?;
        if uvs.is_none() {
            warnings.add(format!("{}: its material has a texture, but there is no {name}", self.at));
        }
        Ok(uvs.map(|uvs| uvs.into_iter().map(|uv| source.apply(uv)).collect()))
    }

    fn colours(&self, count: usize) -> Result<Option<Vec<[u8; 4]>>, LoadError> {
        let name = "COLOR_0";
        let Some(&index) = self.attributes.get(name) else { return Ok(None) };
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let colours = if self.place.accessors.width(index, &format!("{}.{name}", self.at))? == 3 {
            let colours = self.floats::<3>(name, count)?;
            colours.map(|colours| colours.into_iter().map(|[r, g, b]| [r, g, b, 1.0].map(byte)).collect())
        } else {
            self.floats::<4>(name, count)?.map(|colours| colours.into_iter().map(|c| c.map(byte)).collect())
        };
        Ok(colours)
    }

    fn targets(&self, targets: &[BTreeMap<String, usize>], count: usize) -> Result<Vec<MorphTarget>, LoadError> {
        let read = |(index, target): (usize, &BTreeMap<String, usize>)| {
            let deltas = |name: &str| -> Result<Vec<Vec3>, LoadError> {
                let Some(&accessor) = target.get(name) else { return Ok(Vec::new()) };
                let at = format!("{}.targets[{index}].{name}", self.at);
                let deltas = self.place.accessors.floats::<3>(accessor, &at, Count::Exactly(count))?;
                Ok(deltas.into_iter().map(finite).collect())
            };
            Ok(MorphTarget { positions: deltas("POSITION")?, normals: deltas("NORMAL")? })
        };
        targets.iter().enumerate().map(read).collect()
    }

    fn influences(
        &self,
        count: usize,
        joints: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Influences>, LoadError> {
        let mut sets = Vec::new();
        if self.attributes.contains_key(&format!("JOINTS_{MAX_JOINT_SETS}")) {
            warnings.add(format!("{}: joints past the first {} of a vertex are ignored", self.at, 4 * MAX_JOINT_SETS));
        }
        for set in 0..MAX_JOINT_SETS {
            let (joints_name, weights_name) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let Some(&index) = self.attributes.get(&joints_name) else { break };
            let at = format!("{}.{joints_name}", self.at);
            let joints = self.place.accessors.integers::<4>(index, &at, Count::Exactly(count))?;
            let weights = self
                .floats::<4>(&weights_name, count)?
                .ok_or_else(|| LoadError::malformed(self.at, format!("has {joints_name} but no {weights_name}")))?;
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            return Ok(None);
        }
        let per_vertex = 4 * sets.len();
        let mut entries = Vec::with_capacity(count * per_vertex);
        let (mut mended, mut foreign) = (0_usize, 0_usize);
        for vertex in 0..count {
            let start = entries.len();
            for (joint_set, weight_set) in &sets {
                for (&joint, &weight) in joint_set[vertex].iter().zip(&weight_set[vertex]) {
                    let known = (joint as usize) < joints;
                    foreign += usize::from(!known && weight != 0.0);
                    entries.push((if known { joint } else { 0 }, if known { weight } else { 0.0 }));
                }
            }
            mended += usize::from(normalize_weights(&mut entries[start..]));
        }
        if foreign > 0 {
            return Err(LoadError::malformed(
                self.at,
                format!("{foreign} influences are of joints past the skin's {joints}"),
            ));
        }
        warnings.tally(self.at, mended, "vertices whose joint weights are negative or do not sum to 1 are mended");
        Ok(Some(Influences { per_vertex, entries }))
    }
}

fn finite(v: [f32; 3]) -> Vec3 {
    Vec3::from(v.map(|x| if x.is_finite() { x } else { 0.0 }))
}

/// Makes weights sum to 1; whether they were off by more than quantization explains.
fn normalize_weights(entries: &mut [(u32, f32)]) -> bool {
    /// Eight influences of 8 bits, each rounded by half a step.
    const SUM_TOLERANCE: f32 = 8.0 * 0.5 / 255.0;
    let mut bad = false;
    for (_, weight) in entries.iter_mut() {
        if !(weight.is_finite() && *weight >= 0.0) {
            *weight = 0.0;
            bad = true;
        }
    }
    let sum: f32 = entries.iter().map(|(_, weight)| weight).sum();
    if sum > 0.0 && sum.is_finite() {
        entries.iter_mut().for_each(|(_, weight)| *weight /= sum);
    } else {
        entries[0].1 = 1.0;
    }
    bad || (sum - 1.0).abs() > SUM_TOLERANCE
}
