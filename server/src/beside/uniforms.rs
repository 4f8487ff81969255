//! What the compute passes read beside textures and facts.

use std::collections::BTreeSet;

use bytemuck::{Pod, Zeroable};
use camera::{Camera, Pinhole};
use glam::DVec3;
use gpu::uniforms::{Rows, rows as rows_of};
use protocol::PatchId;

use super::asked::Asked;
use super::lists::Room;
use crate::account::facts::{Facts, Place};
use crate::account::{Account, cut_from};

/// `Beside` of `server/beside/view.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct BesideUniform {
    right: [f32; 3],
    focal_px: f32,
    down: [f32; 3],
    near_m: f32,
    forward: [f32; 3],
    look: u32,
    centre_px: [f32; 2],
    size_px: [u32; 2],
    off_plane_footprints: f32,
    along_ray_footprints: f32,
    normal_cos: f32,
    density_factor: f32,
    flags: u32,
    border_px: u32,
    least_px: f32,
    patches: u32,
    most_addresses: u32,
    most_samples: u32,
    slots: u32,
    padding: u32,
}

impl BesideUniform {
    pub(super) fn new(
        camera: &Pinhole,
        asked: &Asked<'_>,
        look: u32,
        room: &Room,
        (patches, slots): (usize, u32),
    ) -> BesideUniform {
        let axis = |axis: DVec3| (camera.world_from_eye.rotation * axis).as_vec3().to_array();
        let rules = asked.rules;
        let flags = [rules.outlines_stand_in, rules.refines, asked.trims, asked.supersedes, asked.is_seen];
        BesideUniform {
            right: axis(DVec3::X),
            focal_px: camera.focal_px as f32,
            down: axis(DVec3::Y),
            near_m: camera.near_m as f32,
            forward: axis(DVec3::Z),
            look,
            centre_px: camera.centre_px.as_vec2().to_array(),
            size_px: [camera.width_px, camera.height_px],
            off_plane_footprints: rules.off_plane_footprints,
            along_ray_footprints: rules.along_ray_footprints,
            normal_cos: rules.normal_cos,
            density_factor: rules.density_factor,
            flags: flags.into_iter().zip(0..).map(|(flag, bit)| u32::from(flag) << bit).sum(),
            border_px: rules.border_px,
            least_px: asked.least_px as f32,
            patches: patches as u32,
            most_addresses: room.addresses,
            most_samples: room.samples,
            slots,
            padding: 0,
        }
    }
}

/// `Patch` of `server/beside/view.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct PatchRow {
    eye_from_patch: Rows,
    centre_px: [f32; 2],
    focal_px: f32,
    w_step: f32,
    id: u32,
    first_word: u32,
    width_px: u32,
    first_mover: u32,
    first_slot: u32,
    slots: u32,
    flags: u32,
    padding: u32,
    cut_px: [u32; 2],
    padding_2: [u32; 2],
}

const PEER: u32 = 1;
const CUT: u32 = 2;

impl PatchRow {
    /// Whether it is cut from a view of the very camera that is looked from.
    pub(super) fn is_cut(&self) -> bool {
        self.flags & CUT != 0
    }
}

/// `Mover` of `server/beside/view.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct MoverRow {
    eye_from_patch: Rows,
    carried: u32,
    padding: u32,
    padding_2: u32,
    padding_3: u32,
}

/// Patches whose facts are kept, by their ids, and the moving objects in them, as a camera sees them: at least one each, as no buffer is empty.
pub(super) fn rows(
    account: &Account,
    facts: &Facts,
    camera: &Pinhole,
    peers: &BTreeSet<PatchId>,
) -> (Vec<PatchRow>, Vec<MoverRow>) {
    let eye_from_world = camera.world_from_eye.inverse().to_affine();
    let held = account.held();
    let (mut patches, mut movers) = (Vec::with_capacity(facts.places().len()), Vec::new());
    for (id, Place { first_word, first_slot, slots, width_px, .. }) in facts.places() {
        let Some(patch) = held.patches.get(&id).map(|held| &held.patch) else { continue };
        let Camera::Pinhole(own) = &patch.image.camera else { continue };
        let eye_from_patch = eye_from_world * own.world_from_eye.to_affine();
        let cut_px = cut_from(camera, &patch.image.camera);
        let flag = |is_set: bool, flag: u32| if is_set { flag } else { 0 };
        patches.push(PatchRow {
            eye_from_patch: rows_of(eye_from_patch),
            centre_px: own.centre_px.as_vec2().to_array(),
            focal_px: own.focal_px as f32,
            w_step: patch.image.depth_scale.w_step,
            id: id.0,
            first_word,
            width_px,
            first_mover: movers.len() as u32,
            first_slot,
            slots,
            flags: flag(peers.contains(&id), PEER) | flag(cut_px.is_some(), CUT),
            padding: 0,
            cut_px: cut_px.map_or([0; 2], |(x, y)| [x, y]),
            padding_2: [0; 2],
        });
        for pose in &patch.objects {
            let captured = pose.world_from_object;
            let now = held.poses_now.get(&pose.object).copied();
            let now_from_captured = now.unwrap_or(captured) * captured.inverse();
            movers.push(MoverRow {
                eye_from_patch: rows_of(eye_from_world * now_from_captured * own.world_from_eye.to_affine()),
                carried: u32::from(now != Some(captured)),
                padding: 0,
                padding_2: 0,
                padding_3: 0,
            });
        }
    }
    if patches.is_empty() {
        patches.push(PatchRow::zeroed());
    }
    if movers.is_empty() {
        movers.push(MoverRow::zeroed());
    }
    (patches, movers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_laid_out_as_in_wgsl() {
        let path = "server/beside/view.wgsl";
        shaders::assert_layout!(
            BesideUniform,
            path,
            "Beside",
            right,
            focal_px,
            down,
            near_m,
            forward,
            look,
            centre_px,
            size_px,
            off_plane_footprints,
            along_ray_footprints,
            normal_cos,
            density_factor,
            flags,
            border_px,
            least_px,
            patches,
            most_addresses,
            most_samples,
            slots
        );
        shaders::assert_layout!(
            PatchRow,
            path,
            "Patch",
            eye_from_patch,
            centre_px,
            focal_px,
            w_step,
            id,
            first_word,
            width_px,
            first_mover,
            first_slot,
            slots,
            flags,
            cut_px
        );
        shaders::assert_layout!(MoverRow, path, "Mover", eye_from_patch, carried);
    }
}
