//! Which objects a view shows by reliefs, and what the GPU reads of each.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use camera::{Bounds, Pinhole};
use glam::{DAffine3, DVec3};
use gpu::uniforms::{Rows, rows};
use protocol::Held;
use protocol::held::HeldInstance;

use crate::draw::impostors::{Impostors, Placed};

/// `Instance` of `client/relief.wgsl`: vertex attributes of an object.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct InstanceVertex {
    anchor_from_eye: Rows,
    eye_from_anchor: Rows,
    /// Of 255: linear RGB, and whether left and right change places.
    tint_mirrored: [u8; 4],
    object: u32,
}

impl InstanceVertex {
    pub const ATTRIBUTES: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
        0 => Float32x4, 1 => Float32x4, 2 => Float32x4,
        3 => Float32x4, 4 => Float32x4, 5 => Float32x4,
        6 => Unorm8x4, 7 => Uint32,
    ];

    /// `None` where the view does not show it, or shows less than a pixel; or where a pose is such that no ray comes back.
    fn new(relief: &Placed, view: &Pinhole, object: u16, world_from_object: DAffine3, tint: [u8; 3]) -> Option<Self> {
        let capture_from_object = relief.pose.map_or(DAffine3::IDENTITY, |(_, at_capture)| at_capture);
        let capture_from_eye = capture_from_object * world_from_object.inverse() * view.world_from_eye.to_affine();
        let anchor_from_eye = DAffine3::from_translation(-relief.anchor_world) * capture_from_eye;
        let eye_from_anchor = anchor_from_eye.inverse();
        if !may_show(view, &eye_from_anchor, &relief.bounds_anchor()) {
            return None;
        }
        let is_mirrored = anchor_from_eye.matrix3.determinant() < 0.0;
        let [red, green, blue] = tint;
        let instance = InstanceVertex {
            anchor_from_eye: rows(anchor_from_eye),
            eye_from_anchor: rows(eye_from_anchor),
            tint_mirrored: [red, green, blue, if is_mirrored { 255 } else { 0 }],
            object: object.into(),
        };
        let mut numbers = instance.anchor_from_eye.iter().chain(&instance.eye_from_anchor).flatten();
        numbers.all(|number| number.is_finite()).then_some(instance)
    }
}

/// Whether a box, moved and bent into eye space, may lie in the view, and is as wide as a pixel.
pub(crate) fn may_show(view: &Pinhole, eye_from_anchor: &DAffine3, bounds_anchor: &Bounds) -> bool {
    let centre_eye = eye_from_anchor.transform_point3(bounds_anchor.middle());
    let half = (bounds_anchor.max - bounds_anchor.min) / 2.0;
    // An affine map leaves the corners of a box furthest from its middle; opposite ones are equally far.
    let corners = [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)];
    let radius_m =
        corners.map(|corner| eye_from_anchor.transform_vector3(half * corner).length()).into_iter().fold(0.0, f64::max);
    // A ball of at most `radius_m` around what is no nearer than `z - radius_m`.
    let is_tiny = 2.0 * radius_m * view.focal_px < centre_eye.z - radius_m;
    view.may_see_ball(centre_eye, radius_m) && !is_tiny
}

/// Of each relief that shows anything, what it shows; a relief that is not there shows nothing.
pub(super) fn shown<'a>(
    impostors: &'a Impostors,
    (held, poses_now): (&Held, &BTreeMap<u16, DAffine3>),
    view: &Pinhole,
) -> Vec<(&'a Placed, Vec<InstanceVertex>)> {
    let mut of_reliefs: BTreeMap<u32, Vec<InstanceVertex>> = BTreeMap::new();
    for (&(object, relief), &HeldInstance { world_from_object, tint }) in &held.instances {
        let Some(placed) = impostors.relief(relief.0) else { continue };
        let world_from_object = *poses_now.get(&object).unwrap_or(&world_from_object);
        if let Some(instance) = InstanceVertex::new(placed, view, object, world_from_object, tint) {
            of_reliefs.entry(relief.0).or_default().push(instance);
        }
    }
    let shown = |(id, instances)| Some((impostors.relief(id)?, instances));
    of_reliefs.into_iter().filter_map(shown).collect()
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    #[test]
    fn what_lies_beside_the_view_or_is_smaller_than_a_pixel_is_left_out() {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (100, 100), 1.0, 0.1);
        let bounds = Bounds { min: DVec3::new(2.0, -1.0, -1.0), max: DVec3::new(4.0, 1.0, 1.0) };
        let shows = |place: DVec3, scale: DVec3| {
            may_show(&view, &(DAffine3::from_translation(place) * DAffine3::from_scale(scale)), &bounds)
        };
        let in_midst = |z: f64| DVec3::new(-3.0, 0.0, z);
        assert!(
            shows(in_midst(5.0), DVec3::ONE) && shows(in_midst(0.0), DVec3::ONE) && !shows(in_midst(-3.0), DVec3::ONE)
        );
        assert!(shows(DVec3::new(-7.5, 0.0, 5.0), DVec3::ONE) && !shows(DVec3::new(-10.0, 0.0, 5.0), DVec3::ONE));
        assert!(shows(DVec3::new(6.0, 0.0, 5.0), DVec3::new(-2.0, 1.0, 1.0)), "mirrored");
        // Its ball is 2 sqrt(3) m wide, as a pixel is in a depth of 317 m.
        assert!(shows(in_midst(310.0), DVec3::ONE) && !shows(in_midst(325.0), DVec3::ONE));
        assert!(!shows(DVec3::Z * 5.0, DVec3::NAN), "nowhere");
    }
}
