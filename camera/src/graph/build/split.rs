use glam::{DVec2, DVec3};

use crate::graph::{FaceDescription, FrustumDescription, GraphDescription, RootDescription};
use crate::{HalfSpace, Pinhole};

/// The camera of three frusta for ambient occlusion (Rosen and others, section 6.3): an output view that sees round both sides
/// of what stands in its middle.
///
/// Up to the plane through `split_world`, across the view direction, it is `view` itself, pixel by pixel. There the left and
/// the right part of the image go on as seen from `shift_m` further left and right, so rays turn inwards behind the split
/// point; both parts end where they meet, at the plane through the eye and the split point, upwards as the eye sees it, and all
/// ends `far_m` from the eye, along the view direction. Points beyond the outermost rays have no image.
///
/// With a `shift_m` of 0 it is `view`, cut into three. The papers put the split point at the object's centroid, or, where the
/// view already sees enough, behind it. A split point outside of the view, or a `far_m` before it, makes a description that is
/// refused with the frustum's name: `centre`, `left` or `right`.
pub fn split_behind(view: &Pinhole, split_world: DVec3, shift_m: f64, far_m: f64) -> GraphDescription {
    let world = |x: f64, y: f64, z: f64| view.world_from_eye.transform_point(DVec3::new(x, y, z));
    let split_eye = view.world_from_eye.inverse().transform_point(split_world);
    let forward = view.world_from_eye.transform_vector(DVec3::Z);
    let rightward = view.world_from_eye.transform_vector(DVec3::new(split_eye.z, 0.0, -split_eye.x));
    let size_px = DVec2::new(view.width_px.into(), view.height_px.into());
    let (low, high) = (view.ray_eye_from_image(0.0, 0.0), view.ray_eye_from_image(size_px.x, size_px.y));
    let z = split_eye.z;
    let end = |point: DVec3| HalfSpace { point, outward: forward };
    let half = |name: &str, side: f64, outer: f64| FrustumDescription {
        name: name.to_owned(),
        centre: world(side * shift_m, 0.0, 0.0),
        faces: vec![FaceDescription {
            parent: "centre".to_owned(),
            corners: [(outer * z, low.y), (split_eye.x, low.y), (split_eye.x, high.y), (outer * z, high.y)]
                .map(|(x, y)| world(x, y * z, z))
                .to_vec(),
        }],
        limits: vec![end(world(0.0, 0.0, far_m)), HalfSpace { point: split_world, outward: rightward * -side }],
    };
    GraphDescription {
        root: RootDescription { name: "centre".to_owned(), pinhole: *view, limits: vec![end(split_world)] },
        frusta: vec![half("left", -1.0, low.x), half("right", 1.0, high.x)],
        min_face_px: 0.0,
    }
}
