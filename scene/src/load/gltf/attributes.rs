//! The vertices of a primitive: floats and whole numbers of accessors, or of a compressed stream.

use std::collections::BTreeMap;

use glam::Vec3;

use super::accessor::{Accessors, Count};
use super::document::Document;
use super::draco::Decompressed;
use super::material::{UvSource, UvSources};
use crate::load::{LoadError, LoadLimits, Warnings};

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

/// Where a primitive stands in its document.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub document: &'a Document,
    pub accessors: Accessors<'a>,
    pub limits: &'a LoadLimits,
    /// By material.
    pub uv_sources: &'a [UvSources],
    /// Of points and lines every one of so many is drawn.
    pub solid_step: usize,
}

/// Attribute sets of four influences that are used. Few files have two; each more would cost time at every frame.
const MAX_JOINT_SETS: usize = 2;

/// Reads what the vertices of one primitive have: from its compressed stream where it is there, else from accessors.
pub(super) struct AttributeReader<'a> {
    pub attributes: &'a BTreeMap<String, usize>,
    pub compressed: Option<&'a Decompressed<'a>>,
    /// The primitive, in messages.
    pub at: &'a str,
    pub place: Place<'a>,
}

impl AttributeReader<'_> {
    /// As many as there are; `None` where the primitive has none.
    pub fn positions(&self) -> Result<Option<Vec<[f32; 3]>>, LoadError> {
        self.counted_floats("POSITION", Count::AtMost(self.place.limits.vertices))
    }

    pub fn floats<const N: usize>(&self, name: &str, count: usize) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        self.counted_floats(name, Count::Exactly(count))
    }

    fn counted_floats<const N: usize>(&self, name: &str, count: Count) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let at = || format!("{}.{name}", self.at);
        let accessor = self.attributes.get(name);
        let normalized = || accessor.and_then(|&a| self.place.document.accessors.get(a)).is_some_and(|a| a.normalized);
        match self.compressed.and_then(|stream| stream.floats(name, normalized())) {
            Some(values) => values.map(Some).map_err(|fault| LoadError::malformed(at(), fault)),
            None => accessor.map(|&index| self.place.accessors.floats(index, &at(), count)).transpose(),
        }
    }

    fn integers<const N: usize>(&self, name: &str, count: usize) -> Result<Option<Vec<[u32; N]>>, LoadError> {
        let at = || format!("{}.{name}", self.at);
        match self.compressed.and_then(|stream| stream.integers(name)) {
            Some(values) => values.map(Some).map_err(|fault| LoadError::malformed(at(), fault)),
            None => {
                let read = |&index| self.place.accessors.integers(index, &at(), Count::Exactly(count));
                self.attributes.get(name).map(read).transpose()
            }
        }
    }

    /// How many components an attribute has; `None` where there is none.
    fn width(&self, name: &str) -> Result<Option<usize>, LoadError> {
        match self.compressed.and_then(|stream| stream.width(name)) {
            Some(width) => Ok(Some(width)),
            None => {
                let read = |&index| self.place.accessors.width(index, &format!("{}.{name}", self.at));
                self.attributes.get(name).map(read).transpose()
            }
        }
    }

    /// Of corners; all vertices in turn where the primitive has no indices.
    pub fn indices(&self, accessor: Option<usize>, vertices: usize) -> Result<Vec<u32>, LoadError> {
        let Some(accessor) = accessor else { return Ok((0..vertices as u32).collect()) };
        let at = format!("{}.indices", self.at);
        let limit = self.place.limits.triangles.saturating_mul(3);
        let indices = self.place.accessors.integers::<1>(accessor, &at, Count::AtMost(limit))?;
        match indices.iter().find(|index| index[0] as usize >= vertices) {
            Some([index]) => Err(LoadError::malformed(at, format!("index {index} is past the {vertices} vertices"))),
            None => Ok(indices.into_flattened()),
        }
    }

    pub fn uvs(
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

    pub fn colours(&self, count: usize) -> Result<Option<Vec<[u8; 4]>>, LoadError> {
        let name = "COLOR_0";
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let colours = if self.width(name)? == Some(3) {
            let colours = self.floats::<3>(name, count)?;
            colours.map(|colours| colours.into_iter().map(|[r, g, b]| [r, g, b, 1.0].map(byte)).collect())
        } else {
            self.floats::<4>(name, count)?.map(|colours| colours.into_iter().map(|c| c.map(byte)).collect())
        };
        Ok(colours)
    }

    pub fn targets(&self, targets: &[BTreeMap<String, usize>], count: usize) -> Result<Vec<MorphTarget>, LoadError> {
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

    pub fn influences(
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
            let Some(joints) = self.integers::<4>(&joints_name, count)? else { break };
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

impl MorphTarget {
    /// Of vertices that stand for those of the file, by their numbers there.
    pub fn of_vertices(self, sources: &[u32]) -> MorphTarget {
        let pick = |deltas: Vec<Vec3>| match deltas.is_empty() {
            true => deltas,
            false => sources.iter().map(|&source| deltas[source as usize]).collect(),
        };
        MorphTarget { positions: pick(self.positions), normals: pick(self.normals) }
    }
}

impl Influences {
    /// Of vertices that stand for those of the file, by their numbers there.
    pub fn of_vertices(self, sources: &[u32]) -> Influences {
        let n = self.per_vertex;
        let entries = sources.iter().flat_map(|&source| &self.entries[source as usize * n..(source as usize + 1) * n]);
        Influences { per_vertex: n, entries: entries.copied().collect() }
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
