//! What the shaders of `client/reflect/` read.

use bytemuck::{Pod, Zeroable};

/// `Round` of `client/reflect/reflector.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct RoundUniform {
    pub bounces: u32,
    pub is_last: u32,
    pub padding: [u32; 2],
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
}

#[cfg(test)]
mod tests {
    use shaders::assert_layout;

    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        assert_layout!(RoundUniform, "client/reflect/reflector.wgsl", "Round", bounces, is_last);
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
            middle_m
        );
    }
}
