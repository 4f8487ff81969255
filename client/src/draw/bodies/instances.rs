//! Where a view sees the objects that bodies show, and what the GPU reads of each.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use camera::{Bounds, Pinhole};
use glam::{DAffine3, DVec3, Vec3};
use gpu::uniforms::{Rows, normal_matrix, rows};
use protocol::{Held, PatchId};

use super::placed::Placed;
use super::store::{Bodies, world_from_object};
use crate::draw::relief::may_show;

/// What is drawn, and from where.
pub(crate) struct BodyInputs<'a> {
    pub bodies: &'a Bodies,
    pub held: &'a Held,
    pub poses_now: &'a BTreeMap<u16, DAffine3>,
    pub camera: &'a Pinhole,
    /// By how much inverse depth is less than it is, as a share.
    pub setback: f32,
}

/// Of `Vertex` of `client/body.wgsl` what is of the object.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct InstanceVertex {
    eye_from_body: Rows,
    world_normal_from_body: Rows,
    /// Linear RGB.
    tint: [u8; 4],
    object: u32,
}

impl InstanceVertex {
    pub const ATTRIBUTES: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
        6 => Float32x4, 7 => Float32x4, 8 => Float32x4,
        9 => Float32x4, 10 => Float32x4, 11 => Float32x4,
        12 => Unorm8x4, 13 => Uint32,
    ];

    /// `None` where a pose is such that nothing can be drawn.
    fn new(eye_from_body: DAffine3, world_from_body: &DAffine3, (object, tint): (u16, [u8; 3])) -> Option<Self> {
        let [red, green, blue] = tint;
        let instance = InstanceVertex {
            eye_from_body: rows(eye_from_body),
            world_normal_from_body: rows(DAffine3::from_mat3(normal_matrix(world_from_body.matrix3))),
            tint: [red, green, blue, u8::MAX],
            object: object.into(),
        };
        let mut numbers = instance.eye_from_body.iter().chain(&instance.world_normal_from_body).flatten();
        numbers.all(|number| number.is_finite()).then_some(instance)
    }
}

/// Objects that one draw shows: all that a view sees of a body, mirrored or not.
pub(super) struct Group<'a> {
    pub placed: &'a Placed,
    pub is_mirrored: bool,
    /// In eye space, in metres: of the nearest corner of the nearest object's box.
    pub nearest_m: f64,
    pub instances: Vec<InstanceVertex>,
}

/// The groups that a view sees, the nearest first, so that what is hidden is not shaded.
pub(super) fn groups<'a>(inputs: &BodyInputs<'a>) -> Vec<Group<'a>> {
    let BodyInputs { bodies, held, poses_now, camera, .. } = *inputs;
    let eye_from_world = camera.world_from_eye.to_affine().inverse();
    let mut groups: BTreeMap<(PatchId, bool), Group<'a>> = BTreeMap::new();
    for (object, id, placed, instance) in bodies.shown(held) {
        let world_from_body = world_from_object(placed, (object, instance), poses_now);
        let eye_from_body = eye_from_world * world_from_body;
        let Some(nearest_m) = nearest_m(camera, &eye_from_body, placed) else { continue };
        let Some(vertex) = InstanceVertex::new(eye_from_body, &world_from_body, (object, instance.tint)) else {
            continue;
        };
        let is_mirrored = world_from_body.matrix3.determinant() < 0.0;
        let new = || Group { placed, is_mirrored, nearest_m, instances: Vec::new() };
        let group = groups.entry((id, is_mirrored)).or_insert_with(new);
        group.nearest_m = group.nearest_m.min(nearest_m);
        group.instances.push(vertex);
    }
    let mut groups: Vec<Group<'a>> = groups.into_values().collect();
    groups.sort_by(|a, b| a.nearest_m.total_cmp(&b.nearest_m));
    groups
}

/// `None` where the view does not show it, or shows less than a pixel.
fn nearest_m(view: &Pinhole, eye_from_body: &DAffine3, placed: &Placed) -> Option<f64> {
    let [min, max] = placed.body.bounds.map(|corner| Vec3::from(corner).as_dvec3());
    let bounds = Bounds { min, max };
    let z_m = |corner: DVec3| eye_from_body.transform_point3(corner).z;
    may_show(view, eye_from_body, &bounds).then(|| bounds.corners().into_iter().map(z_m).fold(f64::INFINITY, f64::min))
}
