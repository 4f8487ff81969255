//! What the shaders of `client/reflect/` read.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};
use gpu::uniforms::columns;

use super::{FULL_FACING_DEG, Settings, fades};
use crate::draw::impostors::{ImpostorKind, Placed};

/// `Round` of `client/reflect/reflector.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct RoundUniform {
    pub bounces: u32,
    pub is_last: u32,
    pub offset_px: [f32; 2],
}

/// `Placed` of `client/reflect/walk.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct PlacedUniform {
    pub capture_from_now: [[f32; 4]; 3],
    pub eye_anchor: [f32; 3],
    pub kind: u32,
    pub object: u32,
    pub full_facing: f32,
    pub filtered: u32,
    pub middle_m: f32,
    pub number: u32,
    pub padding: [u32; 3],
}

impl PlacedUniform {
    /// Where an impostor is as seen from `eye_world`, and what it is; without a number.
    pub fn new(
        placed: &Placed,
        eye_world: DVec3,
        poses_now: &BTreeMap<u16, DAffine3>,
        settings: Settings,
    ) -> PlacedUniform {
        // What has no pose now has not moved.
        let pose_now = placed.pose.and_then(|(object, at_capture)| Some((at_capture, *poses_now.get(&object)?)));
        let capture_from_now = pose_now.map_or(DAffine3::IDENTITY, |(at_capture, now)| at_capture * now.inverse());
        let (kind, object) = match placed.kind {
            ImpostorKind::Object(object) | ImpostorKind::Relief(object) => (0, u32::from(object) + 1),
            ImpostorKind::Environment => (1, 0),
            ImpostorKind::Inside(object) => (2, u32::from(object) + 1),
        };
        PlacedUniform {
            capture_from_now: columns(capture_from_now.matrix3.as_mat3()),
            eye_anchor: (capture_from_now.transform_point3(eye_world) - placed.anchor_world).as_vec3().to_array(),
            kind,
            object,
            full_facing: if fades(placed, settings) { FULL_FACING_DEG.to_radians().sin() as f32 } else { 0.0 },
            filtered: u32::from(settings.filter),
            middle_m: placed.middle_m,
            number: 0,
            padding: [0; 3],
        }
    }
}

#[cfg(test)]
mod tests {
    use shaders::assert_layout;

    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        assert_layout!(RoundUniform, "client/reflect/reflector.wgsl", "Round", bounces, is_last, offset_px);
        assert_layout!(
            PlacedUniform,
            "client/reflect/walk.wgsl",
            "Placed",
            capture_from_now,
            eye_anchor,
            kind,
            object,
            full_facing,
            filtered,
            middle_m,
            number
        );
    }
}
