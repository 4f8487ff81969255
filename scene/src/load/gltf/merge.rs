//! Fewer objects of more parts each: ids of objects have 16 bits, and files of buildings and machines have more parts than that.
//!
//! Parts that neither move nor deform are put together with their neighbours of the same material, along a curve that fills space (Morton, 1966), no more of them than it takes. What
//! moves keeps to itself.

use std::collections::{BTreeMap, HashSet};

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::motion::Source;
use crate::load::geometry::bounds_of;
use crate::load::{LoadError, LoadLimits};
use crate::{Instance, Mesh, Vertex};

/// Steps of the curve along an axis: three of them fill 63 bits.
const STEPS: f64 = ((1_u64 << 21) - 1) as f64;
/// Follows the name of the first of parts that were put together.
const OTHERS: &str = "and others";

/// The parts of a scene, in the order of their objects.
#[derive(Debug)]
pub(super) struct Parts {
    pub meshes: Vec<Mesh>,
    pub instances: Vec<Instance>,
    pub sources: Vec<Source>,
    /// `world_from_mesh` at rest.
    pub rest: Vec<DAffine3>,
}

/// Fewer parts, and which of them each was.
#[derive(Debug)]
pub(super) struct Merged {
    pub parts: Parts,
    /// By the earlier order.
    pub new_of_old: Vec<u32>,
}

/// Puts parts together until there are as many as `limits` allow: no more of them than that takes, and first those of the fewest triangles.
///
/// # Errors
/// [`LoadError::TooLarge`] where more of them move, or have materials of their own, than that; and where triangles or vertices that instances shared are too many.
pub(super) fn merged(parts: Parts, limits: &LoadLimits) -> Result<Merged, LoadError> {
    let stands = |instance: &Instance| !instance.moves && !instance.deforms;
    let mut by_material: BTreeMap<(u32, bool), Vec<usize>> = BTreeMap::new();
    for (index, instance) in parts.instances.iter().enumerate().filter(|(_, instance)| stands(instance)) {
        let mesh = &parts.meshes[instance.mesh as usize];
        by_material.entry((mesh.material, !mesh.second_uvs.is_empty())).or_default().push(index);
    }
    let places = places(&parts);
    let mut rows: Vec<Vec<usize>> = by_material.into_values().collect();
    rows.iter_mut().for_each(|row| row.sort_by_key(|&index| places[index]));
    let standing: usize = rows.iter().map(Vec::len).sum();
    let least = (parts.instances.len() - standing + rows.len()) as u64;
    LoadError::check_limit("objects that move or have a material of their own", least, limits.objects)?;
    let joints = parts.cheapest_joints(&rows, parts.instances.len() - limits.objects as usize);
    let mut groups: Vec<Vec<usize>> =
        (0..parts.instances.len()).filter(|&index| !stands(&parts.instances[index])).map(|index| vec![index]).collect();
    for (number, row) in rows.iter().enumerate() {
        for (place, &index) in row.iter().enumerate() {
            match groups.last_mut().filter(|_| place > 0 && joints.contains(&(number, place - 1))) {
                Some(group) => group.push(index),
                None => groups.push(vec![index]),
            }
        }
    }
    // Objects stay in the order of the file, as far as there are any.
    groups.sort_by_key(|members| members[0]);
    parts.check_copies(&groups, limits)?;
    Ok(parts.in_groups(&groups))
}

/// Where each part lies along the curve.
fn places(parts: &Parts) -> Vec<u64> {
    let middles: Vec<DVec3> = parts.rest.iter().map(|place| place.translation).collect();
    let (min, max) = middles
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &middle| (min.min(middle), max.max(middle)));
    let extent = (max - min).max(DVec3::splat(f64::MIN_POSITIVE));
    let spread = |steps: f64| (0..21).fold(0_u64, |code, bit| code | (steps as u64 >> bit & 1) << (3 * bit));
    let code = |middle: &DVec3| {
        let steps = (*middle - min) / extent * STEPS;
        spread(steps.x) | spread(steps.y) << 1 | spread(steps.z) << 2
    };
    middles.iter().map(code).collect()
}

impl Parts {
    fn mesh_of(&self, index: usize) -> &Mesh {
        &self.meshes[self.instances[index].mesh as usize]
    }

    /// So many joints between neighbours of a row, each by its row and its place there: those that make the groups of the fewest triangles. Of equals every second one first, then every fourth of those that are
    /// left, and so on: groups grow evenly.
    fn cheapest_joints(&self, rows: &[Vec<usize>], count: usize) -> HashSet<(usize, usize)> {
        let triangles = |index: usize| self.mesh_of(index).indices.len() as u64 / 3;
        let joints_of = |(number, row): (usize, &Vec<usize>)| {
            let pairs = row.windows(2).enumerate();
            let joint = |(place, pair): (usize, &[usize])| {
                let grown = 1_u64 << place.trailing_ones();
                ((triangles(pair[0]) + triangles(pair[1])).saturating_mul(grown), number, place)
            };
            pairs.map(joint).collect::<Vec<_>>()
        };
        let mut joints: Vec<(u64, usize, usize)> = rows.iter().enumerate().flat_map(joints_of).collect();
        joints.sort_unstable();
        joints.into_iter().take(count).map(|(_, number, place)| (number, place)).collect()
    }

    /// Refuses groups whose copies of meshes that instances shared are too many.
    fn check_copies(&self, groups: &[Vec<usize>], limits: &LoadLimits) -> Result<(), LoadError> {
        let copied = || groups.iter().filter(|members| members.len() > 1).flatten().map(|&index| self.mesh_of(index));
        let triangles = copied().map(|mesh| mesh.indices.len() as u64 / 3).sum();
        LoadError::check_limit("triangles of parts that are put together", triangles, limits.triangles)?;
        let vertices = copied().map(|mesh| mesh.vertices.len() as u64).sum();
        LoadError::check_limit("vertices of parts that are put together", vertices, limits.vertices)
    }

    /// One part for each group. Meshes that none shows any more are dropped.
    fn in_groups(self, groups: &[Vec<usize>]) -> Merged {
        let mut new_of_old = vec![0; self.instances.len()];
        let mut new = Parts { meshes: Vec::new(), instances: Vec::new(), sources: Vec::new(), rest: Vec::new() };
        let mut new_meshes: BTreeMap<u32, u32> = BTreeMap::new();
        for (object, members) in (0_u32..).zip(groups) {
            members.iter().for_each(|&index| new_of_old[index] = object);
            let first = members[0];
            let (source, instance) = (&self.sources[first], &self.instances[first]);
            if let [index] = members[..] {
                let mesh = *new_meshes.entry(instance.mesh).or_insert_with(|| {
                    new.meshes.push(self.mesh_of(index).clone());
                    new.meshes.len() as u32 - 1
                });
                new.instances.push(Instance { mesh, ..instance.clone() });
                new.sources.push(Source { ..*source });
                new.rest.push(self.rest[index]);
            } else {
                let (mesh, centre_world) = self.put_together(members);
                new.meshes.push(mesh);
                let (mesh, name) = (new.meshes.len() as u32 - 1, format!("{} {OTHERS}", instance.name));
                new.instances.push(Instance { mesh, name, tint: [255; 3], ..instance.clone() });
                new.sources.push(Source { node_from_mesh: DAffine3::IDENTITY, ..*source });
                new.rest.push(DAffine3::from_translation(centre_world));
            }
        }
        Merged { parts: new, new_of_old }
    }

    /// The mesh of parts in their places, relative to their middle, and that, in world space. Its faces are counter-clockwise as they lie there.
    fn put_together(&self, members: &[usize]) -> (Mesh, DVec3) {
        let sum: DVec3 = members.iter().map(|&index| self.rest[index].translation).sum();
        let centre_world = sum / members.len() as f64;
        let mut all = Mesh { material: self.mesh_of(members[0]).material, ..Mesh::default() };
        for &index in members {
            let (mesh, tint) = (self.mesh_of(index), self.instances[index].tint);
            let place = DAffine3::from_translation(-centre_world) * self.rest[index];
            let normals = normal_matrix(&place.matrix3);
            let first = all.vertices.len() as u32;
            all.vertices.extend(mesh.vertices.iter().map(|vertex| placed(vertex, &place, &normals, tint)));
            all.second_uvs.extend_from_slice(&mesh.second_uvs);
            let mirrors = place.matrix3.determinant() < 0.0;
            for &[a, b, c] in mesh.indices.as_chunks::<3>().0 {
                let (b, c) = if mirrors { (c, b) } else { (b, c) };
                all.indices.extend([a, b, c].map(|index| first + index));
            }
        }
        all.bounds = bounds_of(&all.vertices);
        (all, centre_world)
    }
}

/// Normals go by the inverse transpose, with the sign of the determinant; places can be inverted.
fn normal_matrix(linear: &DMat3) -> DMat3 {
    linear.inverse().transpose()
}

fn placed(vertex: &Vertex, place: &DAffine3, normals: &DMat3, tint: [u8; 3]) -> Vertex {
    let position = place.transform_point3(Vec3::from(vertex.position).as_dvec3()).as_vec3().to_array();
    let normal = (*normals * Vec3::from(vertex.normal).as_dvec3()).normalize_or_zero().as_vec3().to_array();
    let [red, green, blue, alpha] = vertex.colour;
    let by = |colour: u8, tint: u8| ((u32::from(colour) * u32::from(tint) + 127) / 255) as u8;
    let colour = [by(red, tint[0]), by(green, tint[1]), by(blue, tint[2]), alpha];
    Vertex { position, normal, colour, ..*vertex }
}
