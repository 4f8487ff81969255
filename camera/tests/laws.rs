//! What holds for every camera model, wherever it stands: project and unproject are inverse, depth orders the points of a ray,
//! and the rasterizer's projection is the camera's own.

mod support;

use glam::{DVec3, Vec4};
use proptest::prelude::*;
use support::{Model, at, graph, model, pinhole, place, pose, spoc};
use vantage_camera::{Camera, FrustumId, ImagePoint, Rigid};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    #[test]
    fn unproject_after_project_is_the_identity(camera in model(), at in at(), depth in 0.0..1.0_f64) {
        let point = camera.point(at, depth);
        let world = camera.world(point);
        let again = camera.image(world);
        prop_assert!(again.is_some(), "{world} of {point:?} has no image");
        let again = again.map(|point| camera.world(point)).unwrap_or_default();
        let slack_m = camera.rounding_m(point, world);
        prop_assert!(again.distance(world) <= slack_m, "{world} came back as {again}, {slack_m:e} m");
    }

    #[test]
    fn inverse_depth_is_positive_and_finite(camera in model(), at in at(), depth in 0.0..1.0_f64) {
        let image = camera.image(camera.world(camera.point(at, depth)));
        prop_assert!(image.is_some_and(|point| point.w > 0.0 && point.w.is_finite()));
    }

    #[test]
    fn no_point_with_an_infinite_or_missing_coordinate_has_an_image(
        spoc in spoc(),
        graph in graph(),
        p in place(),
        axis in 0_usize..3,
        bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e308), Just(-1e308)],
    ) {
        let mut p = p;
        p[axis] = bad;
        prop_assert!(spoc.image_from_world(p).is_none_or(|point| bad.is_finite() && point.u.is_finite()));
        prop_assert_eq!(graph.image_from_world(p), None);
        let ends = graph.segment_pieces(p, graph.bounds_world().middle()).into_iter().flat_map(|piece| [piece.from, piece.to]);
        prop_assert!(ends.into_iter().all(|end| bad.is_finite() && end.u.is_finite() && end.v.is_finite() && end.w > 0.0));
        prop_assert!(graph.ray(p[(axis + 1) % 3], bad).is_empty());
        prop_assert_eq!(graph.frustum_at(ImagePoint { u: p.x, v: bad, w: 1.0 }), None);
        prop_assert_eq!(graph.world_from_image(ImagePoint { u: bad * 10.0, v: 0.0, w: 1.0 }, FrustumId::ROOT), None);
    }

    #[test]
    fn depth_orders_the_points_of_a_ray(pinhole in pinhole(), at in at(), depth in 0.0..1.0_f64, further in 1.001..100.0_f64) {
        let camera = Camera::Pinhole(pinhole);
        let near = camera.point(at, depth);
        let far = ImagePoint { w: near.w / further, ..near };
        let eye = camera.eye_world();
        let (a, b) = (camera.world_from_image(near), camera.world_from_image(far));
        let slack = camera.rounding_m(far, b);
        prop_assert!(a.distance(eye) < b.distance(eye) + slack);
        prop_assert!((b - eye).cross(a - eye).length() <= 2.0 * slack * b.distance(eye), "one ray, one line");
    }

    #[test]
    fn the_rasterizer_projects_as_the_camera(pinhole in pinhole(), at in at(), depth in 0.0..1.0_f64) {
        let point = Camera::Pinhole(pinhole).point(at, depth);
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
    fn inverse_undoes(pose in pose(), p in place()) {
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
