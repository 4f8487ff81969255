//! What holds for the single-pole occlusion camera beyond the laws of every model.

mod support;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use support::{Model, at, pose, rounding_px, spoc};
use vantage_camera::{Bounds, ImagePoint, Pinhole, Rigid, Spoc};

fn px(point: ImagePoint) -> DVec2 {
    DVec2::new(point.u, point.v)
}

/// How many pixels the push changes by with inverse depth, in px m, while it grows.
fn push_slope(camera: &Spoc) -> f64 {
    camera.push_max_px / (1.0 / camera.push_from_m - 1.0 / camera.push_to_m)
}

/// How far the image of a point can be off when its place is, by `world_m`: by what the pinhole's is, stretched, and by what the
/// push changes with depth; and rounded itself.
fn spread_px(camera: &Spoc, p_world: DVec3, world_m: f64) -> f64 {
    let straight = camera.pinhole.image_from_world(p_world).expect("it has an image");
    let point = camera.image_from_world(p_world).expect("it has an image");
    let stretch = 1.0 + camera.push_max_px / camera.ramp_px;
    let straight_px = camera.pinhole.focal_px + px(straight).distance(camera.pinhole.centre_px);
    rounding_px(camera, point) + world_m * point.w * (stretch * straight_px + push_slope(camera) * point.w)
}

/// How far rounding moves points of the world on their way to eye space: a few roundings of the largest coordinate.
fn world_m(camera: &Spoc, p_world: DVec3) -> f64 {
    16.0 * f64::EPSILON * (camera.pinhole.world_from_eye.translation.abs().max_element() + p_world.abs().max_element())
}

/// A box of sides between a thousandth of the near distance and a thousand times it, around a point that the camera sees or,
/// for half of them, behind the eye: some hold the eye, many cross the near plane.
fn box_near(camera: &Spoc, at: DVec2, depth: f64, size: f64) -> Bounds {
    let eye = camera.pinhole.world_from_eye.translation;
    let seen = camera.world(camera.point(at, depth.fract() * 0.5)) - eye;
    let middle = eye + if depth < 1.0 { seen } else { -seen };
    let half = DVec3::splat(camera.pinhole.near_m * 10_f64.powf(size));
    Bounds { min: middle - half, max: middle + half }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    /// One-to-one, and more: two points of one depth are never nearer than in the pinhole's image.
    #[test]
    fn points_of_one_depth_never_come_nearer(camera in spoc(), a in at(), b in at(), depth in 0.0..1.0_f64) {
        let (a, b) = (camera.pinhole.world_from_image(camera.point(a, depth)), camera.pinhole.world_from_image(camera.point(b, depth)));
        let straight = [a, b].map(|p| camera.pinhole.image_from_world(p)).map(|point| point.map(px));
        let pushed = [a, b].map(|p| camera.image_from_world(p));
        if let ([Some(a_px), Some(b_px)], [Some(a), Some(b)]) = (straight, pushed) {
            // The ends' depths are those of the eye's place, rounded: the push changes by what `w` does.
            let slack_px = rounding_px(&camera, a) + rounding_px(&camera, b) + (camera.push_px(a.w) - camera.push_px(b.w)).abs();
            prop_assert!(px(a).distance(px(b)) >= a_px.distance(b_px) - slack_px, "{a:?}, {b:?}, {slack_px:e}");
        }
    }

    #[test]
    fn a_segments_image_is_no_longer_than_its_bound(camera in spoc(), a in at(), b in at(), depths in at()) {
        let (a, b) = (camera.world(camera.point(a, depths.x)), camera.world(camera.point(b, depths.y)));
        const STEPS: u32 = 500;
        let image: Option<Vec<ImagePoint>> =
            (0..=STEPS).map(|step| camera.image_from_world(a.lerp(b, f64::from(step) / f64::from(STEPS)))).collect();
        let Some(image) = image else { return Ok(()) };
        let length_px: f64 = image.windows(2).map(|pair| px(pair[0]).distance(px(pair[1]))).sum();
        let bound_px = camera.length_bound_px(a, b).expect("its ends have images");
        // Both ends of every step are rounded.
        let place_m = world_m(&camera, a) + world_m(&camera, b);
        let at_step = |step: u32| a.lerp(b, f64::from(step) / f64::from(STEPS));
        let slack_px: f64 = (0..=STEPS).map(|step| 2.0 * spread_px(&camera, at_step(step), place_m)).sum();
        prop_assert!(length_px <= bound_px + slack_px, "{length_px} px, bound {bound_px}, slack {slack_px:e}");
    }

    #[test]
    fn all_points_of_a_ray_share_its_image_in_order(camera in spoc(), at in at(), decades in 0.0..6.0_f64, further in 1.001..10.0_f64) {
        let point = camera.point(at, 0.0);
        let ray = camera.ray(point.u, point.v);
        let z_m = 10_f64.powf(decades) / point.w;
        let [(world, near_m), (_, far_m)] = [z_m, z_m * further].map(|z_m| {
            let world = ray.world_at(z_m);
            (world, camera.pinhole.world_from_eye.inverse().transform_point(world).z)
        });
        let place_m = world_m(&camera, world) + world_m(&camera, ray.world_at(z_m * further));
        prop_assert!((near_m - z_m).abs() <= place_m && near_m < far_m + place_m, "{near_m} {z_m} {far_m}");
        let Some(again) = camera.image_from_world(world) else { return Ok(()) };
        // The depth is rounded four times more on the way.
        let slack_px = 2.0 * spread_px(&camera, world, place_m + 4.0 * f64::EPSILON * z_m);
        prop_assert!(px(again).distance(px(point)) <= slack_px, "{point:?} came back as {again:?}, {slack_px:e} px");
    }

    #[test]
    fn a_rays_pieces_join_and_straight_ones_are_straight(camera in spoc(), at in at()) {
        let point = camera.point(at, 0.0);
        let ray = camera.ray(point.u, point.v);
        let pieces = ray.pieces();
        prop_assert_eq!(pieces[0].from_m, camera.pinhole.near_m);
        prop_assert_eq!(pieces[pieces.len() - 1].to_m, f64::INFINITY);
        prop_assert!(pieces.windows(2).all(|pair| pair[0].to_m == pair[1].from_m));
        for piece in pieces.iter().filter(|piece| piece.is_straight) {
            let [a, b, c] = [0.0, 0.37, 1.0].map(|share| {
                let z_m = piece.from_m + (piece.to_m.min(piece.from_m * 100.0) - piece.from_m) * share;
                // A rounded depth is pushed by another amount.
                let push_px = 4.0 * f64::EPSILON * push_slope(&camera) / z_m;
                let rounding_m = camera.rounding_m(ImagePoint { w: 1.0 / z_m, ..point }, ray.world_at(z_m));
                (ray.world_at(z_m), rounding_m + push_px / camera.pinhole.focal_px * z_m)
            });
            let expected = a.0.lerp(c.0, 0.37);
            prop_assert!(b.0.distance(expected) <= a.1 + b.1 + c.1, "{piece:?} bows by {}", b.0.distance(expected));
        }
    }

    /// Also where the box crosses the near plane, holds the eye or the pole's ray.
    #[test]
    fn image_bounds_hold_the_image_of_a_box(
        camera in spoc(), at in at(), depth in 0.0..2.0_f64, size in -3.0..3.0_f64,
        inside in prop::array::uniform3(0.0..=1.0_f64),
    ) {
        let bounds = box_near(&camera, at, depth, size);
        let p = bounds.min + (bounds.max - bounds.min) * DVec3::from(inside);
        let image = camera.image_bounds(&bounds);
        let axis = camera.pinhole.world_from_eye.transform_vector(DVec3::Z);
        let furthest_m = (bounds.middle() - camera.pinhole.world_from_eye.translation).dot(axis)
            + axis.abs().dot(bounds.max - bounds.min) / 2.0;
        if furthest_m < camera.pinhole.near_m * 0.99 - world_m(&camera, p) {
            prop_assert_eq!(image, None, "all of it is nearer than the near plane");
        }
        let Some(point) = camera.image_from_world(p) else { return Ok(()) };
        prop_assert!(image.is_some(), "{point:?} is in no bounds");
        let image = image.expect("checked");
        // Corners of the cut box are found to a billionth of their distance from one another.
        let corner_m = 4.0 * world_m(&camera, p) + 1e-9 * (bounds.max - bounds.min).length();
        let slack_px = 2.0 * spread_px(&camera, p, corner_m);
        let inside = px(point).cmpge(image.min_px - slack_px) & px(point).cmple(image.max_px + slack_px);
        prop_assert!(inside.all(), "{point:?} outside of {image:?}, slack {slack_px:e}");
        let slack_w = corner_m * point.w.powi(2);
        prop_assert!(point.w >= image.w_min - slack_w && point.w <= image.w_max + slack_w);
    }

    #[test]
    fn a_camera_around_an_object_shows_all_of_its_sphere(
        eye in pose(), distance in 1.001..100.0_f64, radius_m in 0.01..100.0_f64, ring in 0.0..10.0_f64,
        direction in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let forward = eye.transform_vector(DVec3::Z);
        let middle = eye.translation + forward * radius_m * distance;
        let half = DVec3::splat(radius_m / 3_f64.sqrt());
        let bounds = Bounds { min: middle - half, max: middle + half };
        let camera = Spoc::around(&bounds, eye.translation, (512, 384), ring * radius_m);
        prop_assert!(camera.is_some());
        let camera = camera.expect("checked");
        prop_assert!(camera.is_valid());
        let radius_m = (bounds.max - bounds.min).length() / 2.0;
        let p = bounds.middle() + DVec3::from(direction).normalize_or(DVec3::X) * radius_m;
        let point = camera.image_from_world(p);
        prop_assert!(point.is_some_and(|point| px(point).distance(camera.pole_px) <= 192.0 * (1.0 + 1e-6)), "{point:?}");
    }

    #[test]
    fn without_a_push_it_is_the_pinhole(camera in spoc(), at in at(), depth in 0.0..1.0_f64) {
        let camera = Spoc { push_max_px: 0.0, ..camera };
        let world = camera.world(camera.point(at, depth));
        let (Some(a), Some(b)) = (camera.image_from_world(world), camera.pinhole.image_from_world(world)) else { return Ok(()) };
        prop_assert!(px(a).distance(px(b)) <= rounding_px(&camera, a) && a.w == b.w);
    }

    #[test]
    fn the_pole_stays_where_it_is(camera in spoc(), depth in 0.0..1.0_f64) {
        let pole = ImagePoint { u: camera.pole_px.x, v: camera.pole_px.y, ..camera.point(DVec2::ZERO, depth) };
        prop_assert_eq!(camera.world_from_image(pole), camera.pinhole.world_from_image(pole));
    }
}

/// A ball of 1 m, 4 m away: how many degrees from the eye's direction its surface is seen by a camera ray, nothing of the ball
/// being before.
fn seen_deg(camera: &Spoc) -> u32 {
    let surface = |degrees: u32| {
        let angle = f64::from(degrees).to_radians();
        DVec3::new(angle.sin(), 0.0, angle.cos() - 4.0)
    };
    let is_seen = |degrees: &u32| {
        let point = camera.image_from_world(surface(*degrees)).expect("before the eye");
        let ray = camera.ray(point.u, point.v);
        (1..1000)
            .all(|step| ray.world_at(f64::from(step) / 1000.0 / point.w).distance(DVec3::NEG_Z * 4.0) >= 1.0 - 1e-9)
    };
    (0..180).take_while(is_seen).last().expect("its front")
}

/// The papers' purpose (section 4): what lies behind the silhouette comes into view. The sphere of `around` is the one around
/// a box, so the ball's box is made to have it.
#[test]
fn a_ball_is_seen_as_from_a_ring_of_eyes() {
    let half = DVec3::splat(1.0 / 3_f64.sqrt());
    let bounds = Bounds { min: DVec3::NEG_Z * 4.0 - half, max: DVec3::NEG_Z * 4.0 + half };
    for ring_m in [0.0, 0.5, 1.0, 2.0, 4.0] {
        let camera = Spoc::around(&bounds, DVec3::ZERO, (512, 512), ring_m).expect("outside");
        let expected = (ring_m / 4.0).atan() + (1.0 / 4_f64.hypot(ring_m)).acos();
        let (seen, expected) = (f64::from(seen_deg(&camera)), expected.to_degrees());
        assert!(
            (seen - expected).abs() <= 1.0,
            "{seen} degrees for {expected} from a ring of {ring_m} m, in whole ones"
        );
    }
}

#[test]
fn an_eye_within_the_object_or_numbers_out_of_range_make_no_camera() {
    let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
    let around = |eye_z: f64, size_px, ring_m| Spoc::around(&bounds, DVec3::Z * eye_z, size_px, ring_m);
    assert!(around(5.0, (64, 64), 0.5).is_some());
    for (eye_z, size_px, ring_m) in [
        (0.5, (64, 64), 0.5),
        (1.7, (64, 64), 0.5),
        (f64::NAN, (64, 64), 0.5),
        (f64::INFINITY, (64, 64), 0.5),
        (5.0, (0, 64), 0.5),
        (5.0, (64, 64), -0.1),
        (5.0, (64, 64), f64::INFINITY),
        (5.0, (64, 64), f64::NAN),
    ] {
        assert_eq!(around(eye_z, size_px, ring_m), None, "{eye_z} {size_px:?} {ring_m}");
    }
    let empty = Bounds { min: DVec3::ZERO, max: DVec3::ZERO };
    assert_eq!(Spoc::around(&empty, DVec3::Z, (64, 64), 0.5), None);
}

#[test]
fn bytes_from_outside_are_checked() {
    let valid = Spoc {
        pinhole: Pinhole::symmetric(Rigid::IDENTITY, (64, 64), 1.0, 0.1),
        pole_px: DVec2::splat(32.0),
        push_from_m: 1.0,
        push_to_m: 2.0,
        push_max_px: 10.0,
        ramp_px: 5.0,
    };
    assert!(valid.is_valid());
    for bad in [
        Spoc { pole_px: DVec2::new(f64::NAN, 0.0), ..valid },
        Spoc { push_from_m: 0.0, ..valid },
        Spoc { push_from_m: 2.0, ..valid },
        Spoc { push_from_m: f64::NAN, ..valid },
        Spoc { push_from_m: 1e-320, ..valid },
        Spoc { push_from_m: 1.0, push_to_m: 1.0 + f64::EPSILON / 4.0, ..valid },
        Spoc { push_to_m: f64::INFINITY, ..valid },
        Spoc { push_to_m: -1.0, ..valid },
        Spoc { push_max_px: -1.0, ..valid },
        Spoc { push_max_px: f64::NAN, ..valid },
        Spoc { push_max_px: f64::INFINITY, ..valid },
        Spoc { ramp_px: 0.0, ..valid },
        Spoc { ramp_px: f64::NAN, ..valid },
        Spoc { push_max_px: 1e300, ramp_px: 1e-300, ..valid },
        Spoc { pinhole: Pinhole { near_m: 0.0, ..valid.pinhole }, ..valid },
    ] {
        assert!(!bad.is_valid(), "{bad:?}");
    }
}
