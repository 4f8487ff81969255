//! Cameras, motions and traces at the ends of their ranges: fields of view from a hair to nearly half a turn, pixels and their rays, ages of time.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

mod support;

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use support::{at, pinhole, place, pose, rotation};
use vantage_camera::{ImagePoint, Motion, Path, Pinhole, Rigid, Trace, TracePose};

/// From a millionth of a radian to a millionth short of half a turn, as often near the ends as between.
fn fov_rad() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-6.0..0.0_f64).prop_map(|decade| 10_f64.powf(decade)),
        1.0..3.0_f64,
        (-6.0..-1.0_f64).prop_map(|decade| PI - 10_f64.powf(decade))
    ]
}

fn motion() -> impl Strategy<Value = Motion> {
    let within = |cap: f32| {
        let length = prop_oneof![Just(0.0), 1e-6..1.0_f32, Just(0.999 * cap)];
        (rotation(), length).prop_map(|(turn, length)| (turn * DVec3::X).as_vec3() * length)
    };
    let fades =
        prop_oneof![Just(None), Just(Some(f32::MIN_POSITIVE)), (1e-3..10.0_f32).prop_map(Some), Just(Some(f32::MAX))];
    let path = prop_oneof![Just(Path::Line), Just(Path::Arc)];
    (within(Motion::MAX_SPEED_M_S), within(Motion::MAX_TURN_RAD_S), path, fades).prop_map(
        |(velocity_world, turn_world, path, fades_in_s)| Motion { velocity_world, turn_world, path, fades_in_s },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_view_of_any_opening_is_valid_and_says_how_wide_it_is(
        pose in pose(),
        fov in fov_rad(),
        width in 1_u32..4096,
        height in 1_u32..4096,
    ) {
        let view = Pinhole::symmetric(pose, (width, height), fov, 0.05);
        prop_assert!(view.is_valid(), "{view:?}");
        // Near half a turn, what is short of it is what counts.
        let (found, size) = (view.fov_y_rad(), fov.min(PI - fov));
        prop_assert!((found - fov).abs() <= 1e-9 * size + 4.0 * f64::EPSILON, "{found:e} instead of {fov:e}");
        // The middle of the upper edge is half of it above the axis.
        let up = view.ray_eye_from_image(f64::from(width) / 2.0, 0.0);
        prop_assert!((up.angle_between(DVec3::Z) - fov / 2.0).abs() < 1e-7, "{up}");
    }

    #[test]
    fn points_come_back_through_a_view_of_any_opening(
        pose in pose(),
        fov in fov_rad(),
        at in at(),
        decade in 0.0..6.0_f64,
    ) {
        let view = Pinhole::symmetric(pose, (1000, 800), fov, 0.05);
        let p_eye = view.ray_eye_from_image(at.x * 1000.0, at.y * 800.0) * 0.06 * 10_f64.powf(decade);
        let point = view.image_from_eye(p_eye);
        prop_assert!(point.is_some());
        let again = view.eye_from_image(point.unwrap());
        let slack_m = 8.0 * f64::EPSILON * (p_eye.length() + 1000.0 / view.focal_px * p_eye.z);
        prop_assert!(again.distance(p_eye) <= slack_m, "{p_eye} came back as {again}");
    }

    #[test]
    fn the_ray_of_a_pixel_meets_that_pixel_and_no_other(view in pinhole(), at in at(), decade in 0.0..7.0_f64) {
        let (x, y) = ((at.x * f64::from(view.width_px)).floor(), (at.y * f64::from(view.height_px)).floor());
        let ray = view.ray_eye_from_image(x + 0.5, y + 0.5);
        let point = view.image_from_eye(ray * view.near_m * 1.001 * 10_f64.powf(decade));
        let is_there = |point: ImagePoint| view.contains(point) && (point.u.floor(), point.v.floor()) == (x, y);
        prop_assert!(point.is_some_and(is_there), "{point:?}");
        let size_px = f64::from(view.width_px.max(view.height_px));
        let off_px = point.map_or(f64::INFINITY, |point| DVec2::new(point.u - x - 0.5, point.v - y - 0.5).length());
        prop_assert!(off_px <= 16.0 * f64::EPSILON * size_px, "{off_px:e} px off");
    }

    #[test]
    fn a_ball_around_a_point_that_is_seen_may_be_seen(
        view in pinhole(),
        at in at(),
        depth in 0.0..6.0_f64,
        way in rotation(),
        radius in 0.0..100.0_f64,
    ) {
        let ray = view.ray_eye_from_image(at.x * f64::from(view.width_px), at.y * f64::from(view.height_px));
        let p_eye = ray * view.near_m * 10_f64.powf(depth);
        let centre = p_eye + way * DVec3::X * radius;
        // A hair larger than what holds the point.
        prop_assert!(view.may_see_ball(centre, radius + 1e-9 * (1.0 + radius + p_eye.length())));
    }

    #[test]
    fn motions_lead_to_poses_for_a_day(
        motion in motion(),
        begin in pose(),
        after_s in prop_oneof![Just(0.0), 0.0..1.0_f64, Just(86_400.0), Just(1e9)],
    ) {
        prop_assert!(motion.is_valid(), "{motion:?}");
        let pose = motion.pose_after(&begin, after_s);
        prop_assert!(pose.is_valid(), "{motion:?} leads to {pose:?}");
        let way_m = pose.translation.distance(begin.translation);
        let most_m = f64::from(motion.velocity_world.length()) * after_s;
        prop_assert!(way_m <= most_m * (1.0 + 1e-6) + 1e-6, "{way_m} m instead of {most_m}");
        prop_assert!(motion.speed_m_s(after_s).is_finite() && motion.turn_rad_s(after_s).is_finite());
        if after_s == 0.0 {
            prop_assert!(way_m <= 1e-6 && pose.rotation.angle_between(begin.rotation) < 1e-6);
        }
    }

    /// What came half of the way goes on to the same place: the direction of a path turns with the view.
    #[test]
    fn motions_that_do_not_fade_go_on_from_anywhere(
        motion in motion(),
        begin in pose(),
        a_s in 0.0..0.5_f64,
        b_s in 0.0..0.5_f64,
    ) {
        let motion = Motion {
            velocity_world: motion.velocity_world.clamp_length_max(100.0),
            turn_world: motion.turn_world.clamp_length_max(6.0),
            fades_in_s: None,
            ..motion
        };
        let half = motion.pose_after(&begin, a_s);
        let turned = half.rotation * begin.rotation.conjugate() * motion.velocity_world.as_dvec3();
        let velocity_world = if motion.path == Path::Arc { turned.as_vec3() } else { motion.velocity_world };
        let there = Motion { velocity_world, ..motion }.pose_after(&half, b_s);
        let at_once = motion.pose_after(&begin, a_s + b_s);
        let slack_m = 1e-4 + 16.0 * f64::EPSILON * begin.translation.length();
        prop_assert!(there.translation.distance(at_once.translation) < slack_m, "{there:?} instead of {at_once:?}");
        prop_assert!(there.rotation.angle_between(at_once.rotation) < 1e-5);
    }

    #[test]
    fn between_two_poses_a_trace_is_between_them(
        a in pose(),
        b in pose(),
        begins_s in -1e3..1e3_f64,
        takes_s in prop_oneof![Just(0.0), 1e-9..1e3_f64],
        share in -0.5..1.5_f64,
    ) {
        let pose = |t_s, world_from_eye| TracePose { t_s, world_from_eye };
        let trace = Trace { poses: vec![pose(begins_s, a), pose(begins_s + takes_s, b)] };
        let found = trace.at(begins_s + share * takes_s);
        prop_assert!(found.is_valid(), "{found:?}");
        let (least, most) = (a.translation.min(b.translation), a.translation.max(b.translation));
        let slack_m = 4.0 * f64::EPSILON * a.translation.length().max(b.translation.length());
        prop_assert!((found.translation - least).min_element() >= -slack_m);
        prop_assert!((most - found.translation).min_element() >= -slack_m);
        let whole_rad = a.rotation.angle_between(b.rotation);
        prop_assert!(found.rotation.angle_between(a.rotation) + found.rotation.angle_between(b.rotation) <= whole_rad + 1e-6);
        // Evenly, but for what times round.
        let rounding = if takes_s > 0.0 { 8.0 * f64::EPSILON * (begins_s.abs() + takes_s) / takes_s } else { 1.0 };
        let evenly = a.translation.lerp(b.translation, share.clamp(0.0, 1.0));
        let off_m = found.translation.distance(evenly);
        prop_assert!(off_m <= rounding * a.translation.distance(b.translation) + 2.0 * slack_m, "{off_m} m off");
        // Held at both ends.
        prop_assert_eq!(trace.at(f64::NEG_INFINITY), trace.at(begins_s - 1.0));
        prop_assert_eq!(trace.at(f64::INFINITY), trace.at(begins_s + takes_s + 1.0));
    }

    #[test]
    fn a_trace_comes_back_from_its_lines(numbers in prop::collection::vec(-1e4..1e4_f64, 6), t_ms in 0.0..1e6_f64) {
        let text: Vec<String> = numbers.iter().chain([&t_ms]).map(f64::to_string).collect();
        let trace = Trace::parse(&text.join(" ")).unwrap();
        let pose = trace.poses[0];
        prop_assert_eq!(pose.world_from_eye.translation, DVec3::from_slice(&numbers));
        prop_assert_eq!(pose.t_s, t_ms / 1000.0);
        prop_assert!(pose.world_from_eye.is_valid());
    }

    #[test]
    fn looking_any_way_is_a_pose_that_looks_that_way(eye in place(), way in rotation(), decade in -12.0..12.0_f64) {
        let forward = way * DVec3::Z;
        let pose = Rigid::look_along(eye, forward * 10_f64.powf(decade));
        prop_assert!(pose.is_valid());
        prop_assert!(pose.transform_vector(DVec3::Z).angle_between(forward) < 1e-6, "{pose:?} looks along {forward}");
        // y is down: the horizon is level, unless it looks straight up or down.
        prop_assert!(pose.transform_vector(DVec3::X).y.abs() < 1e-9 || forward.y.abs() > 1.0 - 1e-9);
    }
}

#[test]
fn a_millimetre_ten_thousand_kilometres_away_is_a_pixel_of_a_telescope() {
    let view = Pinhole::symmetric(Rigid::look_along(DVec3::splat(1e7), DVec3::X), (1000, 1000), 1e-7, 0.1);
    let seen = |side_m: f64| view.image_from_world(DVec3::new(2e7, 1e7, 1e7 + side_m)).unwrap();
    let (middle, beside) = (seen(0.0), seen(1e-3));
    assert!((beside.u - middle.u - 1.0).abs() < 1e-4, "{middle:?} {beside:?}");
    assert!((beside.v - middle.v).abs() < 1e-4 && (middle.w - 1e-7).abs() < 1e-15, "{middle:?} {beside:?}");
}
