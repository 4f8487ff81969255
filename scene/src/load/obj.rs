//! Wavefront OBJ: `v` (with colours), `vt`, `vn`, `f`, `o`, `g`, `usemtl`, `mtllib`; the rest is ignored.
//!
//! The reader is our own: coordinates keep f64 precision (map data is written in metres from afar), faults are named by
//! line, and no input can make it panic. Polygons are cut into fans. Corners without a normal get the area-weighted mean
//! of the faces around their position, across groups. OBJ does not say whether a surface has two sides: it is drawn from
//! both unless the triangles of the file close a solid.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::closed::is_closed;
use super::geometry::{BuildOptions, Geometry, MissingNormals};
use super::motion::{Part, still_scene};
use super::mtl::Library;
use super::numbers::numbers;
use super::source::shorten;
use super::{LoadError, Request, Stage, Warnings};
use crate::{Material, Scene};

/// With more named parts than this, parts of one material are joined: names of single faces name nothing.
const MAX_PARTS: usize = 4096;

/// Marks an index that a corner does not have.
const NONE: u32 = u32::MAX;

/// Indices of position, texture coordinates and normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: u32,
    uv: u32,
    normal: u32,
}

/// Triangles of one name and one material.
#[derive(Debug, Default)]
struct Group {
    name: String,
    material: Option<String>,
    triangles: Vec<[Corner; 3]>,
}

#[derive(Debug, Default)]
struct Obj {
    positions: Vec<DVec3>,
    /// Of each position; empty where the file has none.
    colours: Vec<[u8; 4]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    groups: Vec<Group>,
    libraries: Vec<String>,
    triangles: u64,
    lines_or_points: usize,
}

/// Loads an OBJ file.
pub(super) fn load(bytes: &[u8], request: &Request<'_>) -> Result<Scene, LoadError> {
    let mut warnings = Warnings::default();
    let obj = Obj::parse(bytes, request)?;
    request.report(Stage::Read, 1, 1);
    warnings.tally("OBJ", obj.lines_or_points, "faces of fewer than three corners, points and lines are not drawn");
    let mut library = Library::read(&obj.libraries, request, &mut warnings);
    let groups = obj.joined_groups();
    let all: Vec<[u32; 3]> = obj.position_triangles().collect();
    let default_material = library.materials.len() as u32;
    library.materials.push(Material::default());
    if !is_closed(&obj.positions, &all) {
        library.materials.iter_mut().for_each(|material| material.double_sided = true);
    }
    let smooth = obj.smooth_normals(&all);
    let mut jobs = Vec::with_capacity(groups.len());
    for group in &groups {
        let material = match &group.material {
            None => default_material,
            Some(name) => library.names.get(name).copied().unwrap_or_else(|| {
                warnings.add(format!("OBJ: material {:?} is not defined", shorten(name)));
                default_material
            }),
        };
        jobs.push((group, material));
    }
    let built: Vec<_> = jobs
        .par_iter()
        .map(|(group, material)| {
            let mut warnings = Warnings::default();
            let options = BuildOptions { missing_normals: MissingNormals::Smooth, keep_flat_triangles: false };
            let at = format!("OBJ part {:?}", shorten(&group.name));
            (obj.geometry(group, *material, &smooth).build(&at, options, &mut warnings), warnings)
        })
        .collect();
    let mut parts = Vec::new();
    for ((built, part_warnings), group) in built.into_iter().zip(&groups) {
        warnings.extend(part_warnings);
        if let Some(built) = built {
            parts.push(Part { name: shorten(&group.name), built });
        }
    }
    request.report(Stage::Meshes, 1, 1);
    still_scene(parts, library.materials, library.textures, request, warnings)
}

impl Obj {
    fn parse(bytes: &[u8], request: &Request<'_>) -> Result<Obj, LoadError> {
        let mut obj = Obj::default();
        let (mut name, mut material) = (String::new(), None);
        let mut current: Option<usize> = None;
        let mut known: HashMap<(String, Option<String>), usize> = HashMap::new();
        let text = String::from_utf8_lossy(bytes);
        for (index, line) in logical_lines(&text).into_iter().enumerate() {
            let fault = |fault: &str| LoadError::malformed(format!("OBJ line {}", index + 1), fault);
            let mut words = line.split_whitespace();
            let Some(keyword) = words.next() else { continue };
            let rest = line.trim_start()[keyword.len()..].trim();
            match keyword {
                "v" => obj.add_position(words).map_err(fault)?,
                "vt" => {
                    let [u, v] = numbers(&mut words, 1).ok_or_else(|| fault("texture coordinates are not numbers"))?;
                    // The first row of an image is its top here, and its bottom in OBJ.
                    obj.uvs.push([u as f32, 1.0 - v as f32]);
                }
                "vn" => {
                    let normal: [f64; 3] =
                        numbers(&mut words, 3).ok_or_else(|| fault("a normal is not three numbers"))?;
                    obj.normals.push(normal.map(|x| x as f32));
                }
                "f" => {
                    let slot = *current.get_or_insert_with(|| {
                        *known.entry((name.clone(), material.clone())).or_insert_with(|| {
                            obj.groups.push(Group {
                                name: name.clone(),
                                material: material.clone(),
                                triangles: Vec::new(),
                            });
                            obj.groups.len() - 1
                        })
                    });
                    obj.add_face(words, slot).map_err(fault)?;
                    LoadError::check_limit("triangles", obj.triangles, request.limits.triangles)?;
                }
                "p" | "l" => obj.lines_or_points += 1,
                "o" | "g" => (name, current) = (rest.to_owned(), None),
                "usemtl" => (material, current) = (Some(rest.to_owned()), None),
                "mtllib" => obj.libraries.push(rest.to_owned()),
                _ => {}
            }
            LoadError::check_limit("vertices", obj.positions.len() as u64, request.limits.vertices)?;
        }
        if !obj.colours.is_empty() && obj.colours.len() != obj.positions.len() {
            obj.colours.resize(obj.positions.len(), [255; 4]);
        }
        Ok(obj)
    }

    fn add_position<'a>(&mut self, mut words: impl Iterator<Item = &'a str>) -> Result<(), &'static str> {
        let position: [f64; 3] = numbers(&mut words, 3).ok_or("a position is not three numbers")?;
        self.positions.push(position.into());
        // Three more numbers are a colour, by wide custom; one is a weight, which polygons do not use.
        if let Some(colour) = numbers::<3>(&mut words, 3) {
            self.colours.resize(self.positions.len() - 1, [255; 4]);
            let [r, g, b] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
            self.colours.push([r, g, b, 255]);
        }
        Ok(())
    }

    fn add_face<'a>(&mut self, words: impl Iterator<Item = &'a str>, group: usize) -> Result<(), &'static str> {
        let mut corners = Vec::new();
        for word in words {
            let mut parts = word.split('/');
            let mut next = |count: usize| match parts.next() {
                None | Some("") => Ok(NONE),
                Some(number) => resolve(number, count),
            };
            let corner = Corner {
                position: next(self.positions.len())?,
                uv: next(self.uvs.len())?,
                normal: next(self.normals.len())?,
            };
            if corner.position == NONE {
                return Err("a face's corner has no position");
            }
            corners.push(corner);
        }
        if corners.len() < 3 {
            self.lines_or_points += 1;
            return Ok(());
        }
        self.triangles += corners.len() as u64 - 2;
        let fan = corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]);
        self.groups[group].triangles.extend(fan);
        Ok(())
    }

    /// The groups; by material alone where there are too many names.
    fn joined_groups(&self) -> Vec<Group> {
        let by_name = self.groups.len() <= MAX_PARTS;
        let mut joined: Vec<Group> = Vec::new();
        let mut known: HashMap<(&str, Option<&str>), usize> = HashMap::new();
        for group in self.groups.iter().filter(|group| !group.triangles.is_empty()) {
            let key = (if by_name { group.name.as_str() } else { "" }, group.material.as_deref());
            let slot = *known.entry(key).or_insert_with(|| {
                let name = if key.0.is_empty() { key.1.unwrap_or("unnamed") } else { key.0 };
                joined.push(Group { name: name.to_owned(), material: group.material.clone(), triangles: Vec::new() });
                joined.len() - 1
            });
            joined[slot].triangles.extend_from_slice(&group.triangles);
        }
        joined
    }

    fn position_triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.groups.iter().flat_map(|group| &group.triangles).map(|corners| corners.map(|corner| corner.position))
    }

    /// Area-weighted, by position.
    fn smooth_normals(&self, triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in triangles {
            let [a, b, c] = triangle.map(|index| self.positions[index as usize]);
            let face = (b - a).cross(c - a);
            if face.is_finite() {
                triangle.iter().for_each(|&index| sums[index as usize] += face);
            }
        }
        sums.into_iter().map(|sum| sum.normalize_or(DVec3::Y).as_vec3().into()).collect()
    }

    /// One vertex for each different corner.
    fn geometry(&self, group: &Group, material: u32, smooth: &[[f32; 3]]) -> Geometry {
        let mut known: HashMap<Corner, u32> = HashMap::new();
        let mut order = Vec::new();
        let triangles = group.triangles.iter().map(|corners| {
            corners.map(|corner| {
                *known.entry(corner).or_insert_with(|| {
                    order.push(corner);
                    order.len() as u32 - 1
                })
            })
        });
        let triangles = triangles.collect();
        let pick = |values: &[[f32; 3]], index: u32| values.get(index as usize).copied();
        Geometry {
            positions: order.iter().map(|corner| self.positions[corner.position as usize]).collect(),
            normals: Some(
                order
                    .iter()
                    .map(|corner| pick(&self.normals, corner.normal).unwrap_or(smooth[corner.position as usize]))
                    .collect(),
            ),
            second_uvs: None,
            uvs: Some(
                order.iter().map(|corner| self.uvs.get(corner.uv as usize).copied().unwrap_or_default()).collect(),
            ),
            colours: (!self.colours.is_empty())
                .then(|| order.iter().map(|corner| self.colours[corner.position as usize]).collect()),
            triangles,
            material,
        }
    }
}

/// Lines, with those that end in a backslash joined to the next. A joined line's follower is left empty, so that numbers
/// stay those of the file.
fn logical_lines(text: &str) -> Vec<std::borrow::Cow<'_, str>> {
    let mut lines: Vec<std::borrow::Cow<'_, str>> = Vec::new();
    let mut joined: Option<usize> = None;
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default();
        let (line, goes_on) = match line.trim_end().strip_suffix('\\') {
            Some(line) => (line, true),
            None => (line, false),
        };
        match joined {
            Some(first) => {
                let first: &mut std::borrow::Cow<'_, str> = &mut lines[first];
                first.to_mut().push(' ');
                first.to_mut().push_str(line);
                lines.push("".into());
            }
            None => lines.push(line.into()),
        }
        joined = goes_on.then(|| joined.unwrap_or(lines.len() - 1));
    }
    lines
}

/// An index as written, from 1, or from -1 backwards, to one from 0.
fn resolve(number: &str, count: usize) -> Result<u32, &'static str> {
    let written: i64 = number.parse().map_err(|_| "an index is not a number")?;
    let index = if written > 0 { written - 1 } else { count as i64 + written };
    if written != 0 && (0..count as i64).contains(&index) && index < i64::from(NONE) {
        Ok(index as u32)
    } else {
        Err("an index is out of range")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_count_from_one_and_backwards() {
        assert_eq!(resolve("1", 3), Ok(0));
        assert_eq!(resolve("-1", 3), Ok(2));
        assert!(resolve("0", 3).is_err() && resolve("4", 3).is_err() && resolve("-4", 3).is_err());
        assert!(resolve("99999999999999999999", 3).is_err());
    }

    #[test]
    fn continued_lines_are_joined_and_comments_dropped() {
        assert_eq!(logical_lines("f 1 2 \\\n 3\nv 1 # note"), ["f 1 2   3", "", "v 1 "]);
    }
}
