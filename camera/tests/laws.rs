//! What holds for every camera model, wherever it stands: project and unproject are inverse, depth orders the points of a ray,
//! and the rasterizer's projection is the camera's own.

use glam::{DQuat, DVec2, DVec3, Vec4};
use proptest::prelude::*;
use vantage_camera::{Camera, ImagePoint, Pinhole, Rigid};

/// From a desk to a scene 10,000 km from the origin.
fn place() -> impl Strategy<Value = DVec3> {
    let coordinate = || prop_oneof![-10.0..10.0, -1e7..1e7];
    (coordinate(), coordinate(), coordinate()).prop_map(DVec3::from)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    let part = || -1.0..1.0_f64;
    (part(), part(), part(), part())
        .prop_map(|(x, y, z, w)| DQuat::from_xyzw(x, y, z, w))
        .prop_filter("a direction", |q| q.length() > 0.1)
        .prop_map(DQuat::normalize)
}

/// From half a degree to 120 degrees, with the axis off the middle by up to a quarter of the image.
fn pinhole() -> impl Strategy<Value = Pinhole> {
    let size_px = (1_u32..4096, 1_u32..4096);
    let axis = (-0.25..0.25_f64, -0.25..0.25_f64);
    (place(), rotation(), size_px, 0.01..2.1_f64, axis, 1e-4..1.0_f64).prop_map(
        |(translation, rotation, size_px, fov_y_rad, axis, near_m)| {
            let symmetric = Pinhole::symmetric(Rigid { rotation, translation }, size_px, fov_y_rad, near_m);
            let size_px = DVec2::new(size_px.0.into(), size_px.1.into());
            Pinhole { centre_px: symmetric.centre_px + DVec2::from(axis) * size_px, ..symmetric }
        },
    )
}

fn camera() -> impl Strategy<Value = Camera> {
    pinhole().prop_map(Camera::Pinhole)
}

/// A point of the image, and its depth in units of the near distance: up to seven decades beyond it.
fn seen() -> impl Strategy<Value = (DVec2, f64)> {
    (0.0..1.0_f64, 0.0..1.0_f64, 0.0..7.0_f64)
        .prop_map(|(across, down, decades)| (DVec2::new(across, down), 10_f64.powf(decades)))
}

fn image_point(camera: &Camera, (at, depth): (DVec2, f64)) -> ImagePoint {
    let Camera::Pinhole(pinhole) = camera;
    let (width_px, height_px) = camera.size_px();
    // A hair behind the near plane, where rounding of the place cannot push it before it.
    let near_m = pinhole.near_m + 16.0 * f64::EPSILON * pinhole.world_from_eye.translation.length();
    ImagePoint {
        u: at.x * f64::from(width_px),
        v: at.y * f64::from(height_px),
        w: 1.0 / (near_m * depth * (1.0 + 1e-9)),
    }
}

/// How far rounding can move a world point of a camera: a few roundings of the largest coordinate on the way, through the
/// rotation (three products each, there and back) and the translation.
fn rounding_m(camera: &Camera, world: DVec3) -> f64 {
    16.0 * f64::EPSILON * (camera.eye_world().abs().max_element() + world.abs().max_element())
}

proptest! {
    #[test]
    fn unproject_after_project_is_the_identity(camera in camera(), seen in seen()) {
        let world = camera.world_from_image(image_point(&camera, seen));
        let point = camera.image_from_world(world);
        prop_assert!(point.is_some(), "{world} is behind the near plane");
        let again = point.map(|point| camera.world_from_image(point)).unwrap_or_default();
        prop_assert!(again.distance(world) <= rounding_m(&camera, world), "{world} came back as {again}");
    }

    #[test]
    fn depth_orders_the_points_of_a_ray(camera in camera(), seen in seen(), further in 1.001..100.0_f64) {
        let near = image_point(&camera, seen);
        let far = ImagePoint { w: near.w / further, ..near };
        let eye = camera.eye_world();
        let (a, b) = (camera.world_from_image(near), camera.world_from_image(far));
        let slack = rounding_m(&camera, b);
        prop_assert!(a.distance(eye) < b.distance(eye) + slack);
        prop_assert!((b - eye).cross(a - eye).length() <= 2.0 * slack * b.distance(eye), "one ray, one line");
    }

    #[test]
    fn the_rasterizer_projects_as_the_camera(pinhole in pinhole(), seen in seen()) {
        let point = image_point(&Camera::Pinhole(pinhole), seen);
        let eye = pinhole.eye_from_image(point).as_vec3();
        let clip = pinhole.clip_from_eye() * Vec4::new(eye.x, eye.y, eye.z, 1.0);
        let (width, height) = (f64::from(pinhole.width_px), f64::from(pinhole.height_px));
        let u = (f64::from(clip.x / clip.w) + 1.0) / 2.0 * width;
        let v = (1.0 - f64::from(clip.y / clip.w)) / 2.0 * height;
        // Eight roundings of f32, of terms that are at most the image and its axis' offset wide.
        let slack = |size: f64| 8.0 * f64::from(f32::EPSILON) * size * 2.0;
        prop_assert!((u - point.u).abs() <= slack(width) && (v - point.v).abs() <= slack(height), "{u}, {v}");
        let depth = f64::from(clip.z / clip.w) / pinhole.near_m;
        prop_assert!((depth / point.w - 1.0).abs() <= 8.0 * f64::from(f32::EPSILON));
    }

    #[test]
    fn inverse_undoes(world_from_eye in (place(), rotation()), p in place()) {
        let pose = Rigid { translation: world_from_eye.0, rotation: world_from_eye.1 };
        let again = pose.inverse().transform_point(pose.transform_point(p));
        let size = pose.translation.abs().max_element() + p.abs().max_element();
        prop_assert!(again.distance(p) <= 32.0 * f64::EPSILON * size);
    }

    #[test]
    fn what_is_not_before_the_eye_has_no_image(pinhole in pinhole(), x in -1e3..1e3_f64, y in -1e3..1e3_f64, z in -1e3..1.0_f64) {
        // Up to the near plane: behind the eye, beside it, in it.
        for eye in [DVec3::new(x, y, z * pinhole.near_m * 0.999), DVec3::new(x, y, 0.0), DVec3::ZERO] {
            prop_assert_eq!(pinhole.image_from_eye(eye), None);
        }
    }
}

#[test]
fn an_eye_that_looks_straight_up_or_at_itself_is_valid() {
    for forward in [DVec3::Y, DVec3::NEG_Y, DVec3::ZERO, DVec3::new(1e-300, 1.0, 0.0), DVec3::splat(1e300)] {
        let pose = Rigid::look_along(DVec3::splat(1e7), forward);
        assert!(pose.is_valid(), "along {forward}");
    }
}
