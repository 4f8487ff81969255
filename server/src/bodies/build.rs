//! From an object of a scene to a body.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use protocol::body::{Body, Skin, Wrap};
use protocol::codec::{Coding, encode_patch};
use protocol::image::octahedral;
use protocol::{DepthImage, Edit, Patch, PatchId, Purpose};
use scene::{Mesh, Rig, Scene, Vertex};

use super::atlas::atlas;
use super::clip::{clip, moved};
use super::made::{Made, Unfit};

/// An object as a body; `codes` are those of the scene's materials, see [`crate::imager::Imager::material_codes`].
pub fn build(scene: &Scene, object: u16, codes: &[Option<u8>]) -> Result<Made, Unfit> {
    let instance = &scene.instances[usize::from(object)];
    let mesh = &scene.meshes[instance.mesh as usize];
    let material = &scene.materials[mesh.material as usize];
    let code = fit(scene, instance.mesh, codes)?;
    let (order, indices) = first_used(mesh);
    let vertices: Vec<&Vertex> = order.iter().map(|&vertex| &mesh.vertices[vertex as usize]).collect();
    let rigs = scene.animation.rigs();
    let surface = match rigs.iter().find(|rig| rig.instance == u32::from(object)) {
        Some(rig) => Surface::moved_by_bones(scene, rig, (mesh, &order))?,
        None => Surface::rigid(&vertices),
    };
    let is_textured = material.texture.is_some();
    let uvs: Vec<[f32; 2]> = if is_textured { vertices.iter().map(|vertex| vertex.uv).collect() } else { Vec::new() };
    let of_triangle = |corners: &[u32; 3]| corners.map(|corner| uvs[corner as usize]);
    let triangles = indices.as_chunks::<3>().0.iter().filter(|_| is_textured);
    let triangles_uv: Vec<[[f32; 2]; 3]> = triangles.map(of_triangle).collect();
    let (atlas, [part_uv, part_size]) = atlas(scene, material, code, &triangles_uv);
    let within = |uv: &[f32; 2]| std::array::from_fn(|axis| (uv[axis] - part_uv[axis]) / part_size[axis]);
    let uvs: Vec<[f32; 2]> = uvs.iter().map(within).collect();
    let (uvs, least_uv, step_uv) = quantized(&uvs);
    let (positions, least, step) = quantized(&surface.positions);
    let texture = material.texture.and_then(|texture| scene.textures.get(texture as usize));
    let body = Body {
        positions,
        least,
        step,
        normals: surface.normals.iter().map(|&normal| normal_code(normal.into())).collect(),
        uvs,
        least_uv,
        step_uv,
        colours: colours(&vertices),
        indices,
        double_sided: material.double_sided,
        cut_out: material.alpha_cutoff.is_some(),
        wrap: texture.map_or([Wrap::Clamp; 2], |texture| texture.wrap.map(wrap_of)),
        nearest: texture.is_some_and(|texture| texture.nearest),
        bounds: surface.bounds,
        skin: surface.skin,
    };
    made(atlas, body, surface.origin_world)
}

/// What a body is but for its colours.
struct Surface {
    positions: Vec<[f32; 3]>,
    /// None where each triangle is shaded as the plane that it is.
    normals: Vec<[f32; 3]>,
    bounds: [[f32; 3]; 2],
    skin: Option<Skin>,
    origin_world: Option<DVec3>,
}

impl Surface {
    fn rigid(vertices: &[&Vertex]) -> Surface {
        let positions: Vec<[f32; 3]> = vertices.iter().map(|vertex| vertex.position).collect();
        let bounds = bounds_of(&positions).map(|corner| corner.to_array());
        let normals = vertices.iter().map(|vertex| vertex.normal).collect();
        Surface { positions, normals, bounds, skin: None, origin_world: None }
    }

    fn moved_by_bones(scene: &Scene, rig: &Rig, (mesh, order): (&Mesh, &[u32])) -> Result<Surface, Unfit> {
        let origin_world = scene.at(0.0).world_from_mesh[rig.instance as usize].translation;
        let unbent = |vertex: &u32| {
            let own = &mesh.vertices[*vertex as usize];
            rig.unbent.get(*vertex as usize).copied().unwrap_or([own.position, own.normal])
        };
        let (positions, normals): (Vec<_>, Vec<_>) = order.iter().map(unbent).map(|[p, normal]| (p, normal)).unzip();
        let [least, most] = bounds_of(&positions);
        let by_first = [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)];
        let influences = order.iter().map(|&vertex| rig.influences.get(vertex as usize).copied().unwrap_or(by_first));
        let rig = Rig { influences: influences.collect(), ..rig.clone() };
        let places: Vec<Vec3> = positions.iter().map(|&p| p.into()).collect();
        let (skin, bounds) = skin(scene, &rig, &places, (origin_world, f64::from((most - least).length()) / 2.0))?;
        let normals = if rig.is_flat { Vec::new() } else { normals };
        Ok(Surface { positions, normals, bounds, skin: Some(skin), origin_world: Some(origin_world) })
    }
}

/// Smallest and largest corner of a box around places.
fn bounds_of(places: &[[f32; 3]]) -> [Vec3; 2] {
    let places = places.iter().map(|&p| Vec3::from(p));
    places.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

/// What vertices' colours are multiplied by; none where that is white everywhere.
fn colours(vertices: &[&Vertex]) -> Vec<[u8; 3]> {
    if vertices.iter().all(|vertex| vertex.colour[..3] == [255; 3]) {
        return Vec::new();
    }
    vertices.iter().map(|vertex| [vertex.colour[0], vertex.colour[1], vertex.colour[2]]).collect()
}

/// The body with what it takes on the wire.
fn made(atlas: DepthImage, body: Body, origin_world: Option<DVec3>) -> Result<Made, Unfit> {
    if !body.is_whole() {
        return Err(Unfit::NotFinite);
    }
    let body = Arc::new(body);
    let patch =
        Patch { id: PatchId(0), purpose: Purpose::Body, capture_time_s: 0.0, objects: Vec::new(), image: atlas };
    let triangles = protocol::wire::edit_bytes(&Edit::Body(PatchId(0), body.clone()));
    let colours = encode_patch(&patch, Coding::default());
    let bytes = (colours.len() + triangles.len()) as u64;
    tracing::debug!(colours = colours.len(), triangles = triangles.len(), "a body's bytes");
    Ok(Made { atlas: patch.image, body, origin_world, bytes })
}

/// The code of a mesh's material, where that is the same everywhere and hides what is behind it.
pub(super) fn fit(scene: &Scene, mesh: u32, codes: &[Option<u8>]) -> Result<u8, Unfit> {
    let mesh = scene.meshes.get(mesh as usize).filter(|mesh| mesh.indices.len() >= 3).ok_or(Unfit::Empty)?;
    let material = scene.materials.get(mesh.material as usize).ok_or(Unfit::Varies)?;
    if scene.is_seen_through(mesh.material as usize) || material.transmission > 0.0 {
        return Err(Unfit::SeenThrough);
    }
    if material.alpha_cutoff.is_some() && mesh.vertices.iter().any(|vertex| vertex.colour[3] != u8::MAX) {
        return Err(Unfit::CutByVertices);
    }
    codes.get(mesh.material as usize).copied().flatten().ok_or(Unfit::Varies)
}

fn skin(scene: &Scene, rig: &Rig, positions: &[Vec3], place: (DVec3, f64)) -> Result<(Skin, [[f32; 3]; 2]), Unfit> {
    let moved = moved(rig, positions);
    let (clip, bounds) = clip(scene, rig, place, &moved)?;
    // No more than fit a byte.
    let places: BTreeMap<u32, u8> = moved.keys().copied().zip(0..=u8::MAX).collect();
    let place = |(bone, _): (u32, f32)| places.get(&bone).copied().unwrap_or_default();
    let bones = rig.influences.iter().map(|four| four.map(place)).collect();
    let shares = rig.influences.iter().map(|four| shares(four.map(|(_, share)| share))).collect();
    Ok((Skin { bones, shares, clip }, bounds.map(|corner| corner.to_array())))
}

/// Shares of 65,535 whose sum is that: what rounding leaves goes to the largest, which it changes least.
fn shares(four: [f32; 4]) -> [u16; 4] {
    let mut shares = four.map(|share| (share * 65535.0).round() as i32);
    let largest = (0..4).max_by_key(|&index| shares[index]).unwrap_or(0);
    shares[largest] += 65535 - shares.iter().sum::<i32>();
    shares.map(|share| share.clamp(0, 65535) as u16)
}

/// The vertices in the order in which triangles first use them, and the triangles by that order.
fn first_used(mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
    let mut order = Vec::new();
    let mut places = HashMap::new();
    let indices = mesh.indices.iter().map(|&vertex| {
        *places.entry(vertex).or_insert_with(|| {
            order.push(vertex);
            order.len() as u32 - 1
        })
    });
    let indices = indices.collect();
    (order, indices)
}

/// Numbers in 65,535 steps between the least and the largest, along each axis.
fn quantized<const N: usize>(rows: &[[f32; N]]) -> (Vec<[u16; N]>, [f32; N], [f32; N]) {
    let along = |axis: usize| rows.iter().map(move |row| row[axis]);
    let least: [f32; N] =
        std::array::from_fn(|axis| if rows.is_empty() { 0.0 } else { along(axis).fold(f32::INFINITY, f32::min) });
    let step: [f32; N] =
        std::array::from_fn(|axis| (along(axis).fold(least[axis], f32::max) - least[axis]) / f32::from(u16::MAX));
    let code = |value: f32, axis: usize| {
        if step[axis] > 0.0 { ((value - least[axis]) / step[axis]).round().clamp(0.0, 65535.0) as u16 } else { 0 }
    };
    let codes = rows.iter().map(|row| std::array::from_fn(|axis| code(row[axis], axis))).collect();
    (codes, least, step)
}

fn normal_code(normal: Vec3) -> [u16; 2] {
    let half = f32::from(Body::NORMAL_STEPS) / 2.0;
    octahedral(normal).to_array().map(|number| ((number + 1.0) * half).round() as u16)
}

fn wrap_of(wrap: scene::model::Wrap) -> Wrap {
    match wrap {
        scene::model::Wrap::Repeat => Wrap::Repeat,
        scene::model::Wrap::Mirror => Wrap::Mirror,
        scene::model::Wrap::Clamp => Wrap::Clamp,
    }
}
