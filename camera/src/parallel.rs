//! Views from several eyes that look the same way with one scale, so that what they see differs by a shift that is linear in `w`: the
//! images of an area light's corners and points.

use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::{Bounds, Pinhole, Rigid};

/// No image reaches further from its axis than this tangent (76 degrees) as long as faces of a cube can be had instead. What lies parallel to the image
/// has the same texels everywhere, so a wide image loses nothing by it.
const WIDEST_TANGENT: f64 = 4.0;
/// Nor is it longer than this many times the side of a square of as many pixels.
const LONGEST: f64 = 2.0;
/// How near to an eye things are seen that stand all around it, as a share of the distance of the farthest. See [`parallel_views`].
/// As for shadow maps: 24 bits of depth tell apart 2^12 / 2^24 of the distance at the far end, less than what a texel spans.
const NEAREST: f64 = 1.0 / 4096.0;

/// The pinholes by which `eyes` see all of `bounds`, a face after the other, and in each face one for each eye, in order. All of a face share
/// rotation, focal length and size; their image centres differ, so that each holds the box as closely as that size allows.
///
/// One face along `plane`'s normal is enough where the box lies on one side of it and is seen within 76 degrees of it; else one towards
/// the box; else those faces of cubes around the eyes that the box reaches into. A face has about `side_px²` pixels, one of a cube a
/// quarter of that. `plane` are two vectors in the plane that the eyes lie in; images lie parallel to it, where they can. None where the
/// box is empty or not finite.
///
/// Depths begin at the box, or for a cube at 1/4096 of the way to its farthest corner.
pub fn parallel_views(eyes: &[DVec3], plane: [DVec3; 2], bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
    let is_usable = eyes.iter().all(|eye| eye.is_finite())
        && bounds.min.is_finite()
        && bounds.max.is_finite()
        && bounds.min.cmple(bounds.max).all();
    let Some(middle) =
        eyes.iter().copied().reduce(|a, b| a + b).filter(|_| is_usable).map(|sum| sum / eyes.len() as f64)
    else {
        return Vec::new();
    };
    let to_box = (bounds.middle() - middle).try_normalize();
    let along_plane = axes(plane, to_box);
    let towards = to_box.map(|forward| Rigid::look_along(DVec3::ZERO, forward).rotation);
    let one = [along_plane, towards].into_iter().flatten().find_map(|rotation| whole(eyes, rotation, bounds, side_px));
    one.map_or_else(
        || cube(eyes, along_plane.or(towards).unwrap_or(DQuat::IDENTITY), bounds, side_px),
        |face| vec![face],
    )
}

/// The orientation along the plane's normal, on the side of the box, with the image's x axis along the plane's first vector.
fn axes([u, v]: [DVec3; 2], to_box: Option<DVec3>) -> Option<DQuat> {
    let normal = u.cross(v).try_normalize()?;
    let forward = if to_box.is_some_and(|to_box| normal.dot(to_box) < 0.0) { -normal } else { normal };
    let right = u.try_normalize()?;
    Some(DQuat::from_mat3(&DMat3::from_cols(right, forward.cross(right), forward)).normalize())
}

/// One image an eye that holds the whole box; `None` where the box is not wholly before all eyes, or too wide.
fn whole(eyes: &[DVec3], rotation: DQuat, bounds: Bounds, side_px: u32) -> Option<Vec<Pinhole>> {
    let corners: Vec<DVec3> = bounds.corners().map(|corner| rotation.conjugate() * corner).to_vec();
    let mut nearest_m = f64::INFINITY;
    let mut windows = Vec::with_capacity(eyes.len());
    for eye in eyes {
        let eye = rotation.conjugate() * *eye;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in &corners {
            let p = *corner - eye;
            let tangent = p.truncate() / p.z;
            let is_seen = p.z > 0.0 && tangent.abs().max_element() <= WIDEST_TANGENT;
            if !is_seen {
                return None;
            }
            nearest_m = nearest_m.min(p.z);
            (low, high) = (low.min(tangent), high.max(tangent));
        }
        windows.push((low, high));
    }
    let extent = windows.iter().fold(DVec2::ZERO, |widest, (low, high)| widest.max(*high - *low));
    let side_px = f64::from(side_px);
    let square = side_px / (extent.x * extent.y).sqrt();
    let focal_px = square.min(LONGEST * side_px / extent.max_element());
    if !(focal_px.is_finite() && focal_px > 0.0) {
        return None;
    }
    // A pixel beside it on each side.
    let [width_px, height_px] = (extent * focal_px).to_array().map(|length| length.ceil() as u32 + 2);
    let view = |(eye, (low, high)): (&DVec3, &(DVec2, DVec2))| Pinhole {
        world_from_eye: Rigid { rotation, translation: *eye },
        width_px,
        height_px,
        focal_px,
        centre_px: DVec2::new(width_px.into(), height_px.into()) / 2.0 - (*low + *high) / 2.0 * focal_px,
        // The box's front shows: a thousandth is far more than the 2^-24 that an f32 rounds, and costs no depth.
        near_m: 0.999 * nearest_m,
    };
    Some(eyes.iter().zip(&windows).map(view).collect())
}

/// Those faces of cubes around the eyes that the box reaches into, a pixel wider than a right angle on each side.
fn cube(eyes: &[DVec3], rotation: DQuat, bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
    let side_px = (side_px / 2).max(4);
    let (x, y, z) = (rotation * DVec3::X, rotation * DVec3::Y, rotation * DVec3::Z);
    let faces = [[x, y, z], [x, -y, -z], [-z, y, x], [z, y, -x], [x, -z, y], [x, z, -y]];
    let furthest_m =
        eyes.iter().flat_map(|eye| bounds.corners().map(|corner| corner.distance(*eye))).fold(0.0, f64::max);
    if furthest_m <= 0.0 {
        return Vec::new();
    }
    let face = |[right, down, forward]: [DVec3; 3]| -> Option<Vec<Pinhole>> {
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, down, forward)).normalize();
        let view = |eye: &DVec3| Pinhole {
            world_from_eye: Rigid { rotation, translation: *eye },
            width_px: side_px,
            height_px: side_px,
            focal_px: f64::from(side_px) / 2.0 - 1.0,
            centre_px: DVec2::splat(f64::from(side_px) / 2.0),
            near_m: NEAREST * furthest_m,
        };
        let views: Vec<Pinhole> = eyes.iter().map(view).collect();
        views.iter().any(|view| may_show(view, bounds)).then_some(views)
    };
    faces.into_iter().filter_map(face).collect()
}

/// Whether the box does not lie wholly beyond one side of the view.
fn may_show(view: &Pinhole, bounds: Bounds) -> bool {
    let eye_from_world = view.world_from_eye.inverse();
    let points = bounds.corners().map(|corner| eye_from_world.transform_point(corner));
    let tangent = f64::from(view.width_px) / 2.0 / view.focal_px;
    let beyond = |side: &dyn Fn(&DVec3) -> f64| points.iter().all(|p| side(p) > tangent * p.z);
    !(points.iter().all(|p| p.z <= 0.0)
        || beyond(&|p| p.x)
        || beyond(&|p| -p.x)
        || beyond(&|p| p.y)
        || beyond(&|p| -p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { min: DVec3::new(-4.0, 0.0, -3.0), max: DVec3::new(5.0, 2.0, 6.0) };
    const PLANE: [DVec3; 2] = [DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 1.0)];

    fn corners(middle: DVec3) -> Vec<DVec3> {
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(s, t)| middle + PLANE[0] * s + PLANE[1] * t).to_vec()
    }

    fn shows(view: &Pinhole, p: DVec3) -> bool {
        view.image_from_world(p).is_some_and(|point| view.contains(point) && point.w * view.near_m <= 1.0)
    }

    #[test]
    fn a_lamp_above_sees_all_by_one_image_an_eye_parallel_to_itself() {
        let faces = parallel_views(&corners(DVec3::new(0.0, 9.0, 1.0)), PLANE, BOX, 256);
        assert_eq!((faces.len(), faces[0].len()), (1, 4));
        for view in &faces[0] {
            assert!(view.is_valid());
            assert!(BOX.corners().iter().all(|corner| shows(view, *corner)));
            assert!((view.world_from_eye.transform_vector(DVec3::Z) - DVec3::NEG_Y).length() < 1e-12);
            assert!((view.world_from_eye.transform_vector(DVec3::X) - DVec3::X).length() < 1e-12);
            let pixels = view.width_px * view.height_px;
            assert!((256 * 256..=270 * 270).contains(&pixels), "{pixels}");
            assert_eq!((view.focal_px, view.width_px), (faces[0][0].focal_px, faces[0][0].width_px));
        }
    }

    #[test]
    fn what_a_point_shifts_by_between_eyes_is_linear_in_its_inverse_depth() {
        let faces = parallel_views(&corners(DVec3::new(0.0, 9.0, 1.0)), PLANE, BOX, 256);
        let [a, b] = [&faces[0][0], &faces[0][1]];
        let apart =
            b.world_from_eye.inverse().transform_vector(b.world_from_eye.translation - a.world_from_eye.translation);
        for p in [DVec3::new(1.0, 0.3, 0.2), DVec3::new(-3.9, 1.9, 5.0)] {
            let (in_a, in_b) = (a.image_from_world(p).expect("before it"), b.image_from_world(p).expect("before it"));
            assert!((in_a.w - in_b.w).abs() < 1e-12);
            let shift = DVec2::new(in_a.u - a.centre_px.x, in_a.v - a.centre_px.y)
                - DVec2::new(in_b.u - b.centre_px.x, in_b.v - b.centre_px.y);
            assert!((shift - a.focal_px * apart.truncate() * in_a.w).length() < 1e-9);
        }
    }

    #[test]
    fn a_lamp_within_sees_everything_by_faces_of_a_cube() {
        let eyes = corners(DVec3::new(0.5, 1.0, 1.0));
        let faces = parallel_views(&eyes, PLANE, BOX, 256);
        assert_eq!(faces.len(), 6);
        for index in 0..1000 {
            let part = |by: u32| f64::from(index * by % 1009) / 1009.0;
            let p = BOX.min + (BOX.max - BOX.min) * DVec3::new(part(1), part(31), part(577));
            for eye in 0..eyes.len() {
                assert!(faces.iter().any(|face| shows(&face[eye], p)), "{p}");
            }
        }
    }

    #[test]
    fn a_lamp_beside_looks_towards_it_and_a_hopeless_one_has_no_image() {
        // The box reaches over the lamp's plane, far away.
        let beside = parallel_views(&corners(DVec3::new(40.0, 1.0, 0.0)), PLANE, BOX, 64);
        assert_eq!(beside.len(), 1);
        assert!(BOX.corners().iter().all(|corner| beside[0].iter().all(|view| shows(view, *corner))));
        assert!(parallel_views(&corners(DVec3::NAN), PLANE, BOX, 64).is_empty());
        assert!(parallel_views(&[], PLANE, BOX, 64).is_empty());
        let nothing = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        assert!(parallel_views(&corners(DVec3::Y), PLANE, nothing, 64).is_empty());
        // No extent, and on the box's own only point.
        let point = Bounds { min: DVec3::Y, max: DVec3::Y };
        assert!(parallel_views(&[DVec3::Y; 4], [DVec3::ZERO; 2], point, 64).is_empty());
        let far = parallel_views(&[DVec3::splat(1e5)], [DVec3::ZERO; 2], BOX, 64);
        assert!(far.len() == 1 && far[0][0].is_valid());
    }
}
