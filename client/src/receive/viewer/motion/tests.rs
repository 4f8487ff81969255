use std::f64::consts::TAU;

use super::*;

/// The motion that is told at the last of some frames, 60 a second.
fn told(at: impl Fn(f64) -> Rigid, frames: u32) -> Motion {
    let mut estimator = MotionEstimator::default();
    (0..frames).map(|frame| f64::from(frame) / 60.0).fold(Motion::STILL, |_, t_s| estimator.see(at(t_s), t_s))
}

fn round(angle: f64) -> Rigid {
    Rigid::look_at(DVec3::new(3.0 * angle.sin(), 1.0, 3.0 * angle.cos()), DVec3::new(0.0, 0.4, 0.0))
}

#[test]
fn a_line_with_a_turning_head_is_a_line() {
    let walk = told(|t_s| Rigid::look_along(DVec3::X * 1.4 * t_s, DVec3::new(t_s.sin(), 0.0, -t_s.cos())), 30);
    assert_eq!((walk.path, walk.fades_in_s), (Path::Line, None));
    assert!(walk.velocity_world.as_dvec3().distance(DVec3::X * 1.4) < 1e-5, "{walk:?}");
    assert!(walk.turn_world.as_dvec3().distance(DVec3::NEG_Y) < 1e-5, "{walk:?}");
}

#[test]
fn who_turns_on_the_spot_goes_nowhere() {
    let turn = told(|t_s| Rigid::look_along(DVec3::X, DVec3::new(t_s.sin(), 0.0, -t_s.cos())), 30);
    assert_eq!(turn.velocity_world, glam::Vec3::ZERO);
    assert!((turn.turn_world.y + 1.0).abs() < 1e-5, "{turn:?}");
}

#[test]
fn an_orbit_is_an_arc_about_its_pivot_from_the_third_pose_on() {
    for frames in [LEAST_POSES as u32, 5, 60] {
        let eye = round(2.0 * f64::from(frames - 1) / 60.0).translation;
        let arc = told(|t_s| round(2.0 * t_s), frames);
        let pivot = arc.pivot_world(eye).unwrap_or_else(|| panic!("an arc after {frames} frames: {arc:?}"));
        assert!(pivot.distance(DVec3::Y) < 1e-4, "{frames} frames: {pivot}");
        assert!((arc.turn_world.y - 2.0).abs() < 1e-4 && arc.fades_in_s.is_none(), "{arc:?}");
    }
}

#[test]
fn a_drag_of_whole_pixels_at_odd_times_turns_about_the_same_pivot_evenly() {
    let mut estimator = MotionEstimator::default();
    let (mut pixels, mut rates) = (0_u32, Vec::new());
    for frame in 0..120_u32 {
        // 0 to 5 pixels a frame, 2.5 in the mean, as a hand and an event queue make them.
        pixels += frame.wrapping_mul(2_654_435_761) >> 20 & 5;
        let angle = f64::from(pixels) * 0.01;
        let motion = estimator.see(round(angle), f64::from(frame) / 60.0);
        if frame < 20 {
            continue;
        }
        assert!(!motion.is_still(), "frame {frame}: a pause of a frame is no stop");
        let pivot = motion.pivot_world(round(angle).translation).unwrap_or_else(|| panic!("frame {frame}: {motion:?}"));
        assert!(pivot.distance(DVec3::Y) < 1e-3, "frame {frame}: {pivot}");
        rates.push(f64::from(motion.turn_world.y));
    }
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    let spread = (rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>() / rates.len() as f64).sqrt();
    assert!((mean - 1.5).abs() < 0.2 && spread < 0.5 * mean, "{mean} rad/s, give or take {spread}");
}

#[test]
fn a_flick_fades() {
    let flick = told(|t_s| round(6.0 * 0.24 * (1.0 - (-t_s / 0.24).exp())), 20);
    assert_eq!((flick.path, flick.fades_in_s), (Path::Arc, Some(0.24)));
    let left = 6.0 * (-19.0_f64 / 60.0 / 0.24).exp();
    assert!((f64::from(flick.turn_world.y) - left).abs() < 0.01 * left, "{flick:?}");
}

#[test]
fn a_start_is_as_fast_as_it_has_come_and_does_not_grow_for_ever() {
    // From rest to 2.4 rad/s in a tenth of a second, and so on.
    let angle = |t_s: f64| 2.4 * if t_s < 0.1 { t_s * t_s / 0.2 } else { t_s - 0.05 };
    for frames in 3..20 {
        let start = told(|t_s| round(angle(t_s)), frames);
        let rate = (24.0 * f64::from(frames - 1) / 60.0).min(2.4);
        let off = f64::from(start.turn_world.y) / rate - 1.0;
        assert!(off.abs() < 0.15, "{off} after {frames} frames: {start:?}");
        assert_eq!(start.fades_in_s, None);
    }
}

#[test]
fn a_stop_is_seen_at_once() {
    for stop_s in [0.1, 0.5] {
        let frames = (stop_s * 60.0) as u32;
        let stopping = |t_s: f64| round(2.5 * t_s.min(f64::from(frames) / 60.0));
        assert!(!told(stopping, frames + 1).is_still());
        assert!(told(stopping, frames + 2).is_still(), "two equal poses");
    }
}

#[test]
fn who_is_put_elsewhere_did_not_move_there() {
    let walk = |t_s: f64| Rigid::look_along(DVec3::X * (t_s + if t_s >= 0.5 { 100.0 } else { 0.0 }), DVec3::NEG_Z);
    assert!(told(walk, 31).is_still());
    let after = told(walk, 32);
    assert!((f64::from(after.velocity_world.x) - 1.0).abs() < 1e-5, "{after:?}");
    let turned = |t_s: f64| round(TAU / 4.0 * f64::from(u8::from(t_s >= 0.5)));
    assert!(told(turned, 31).is_still(), "a quarter in a frame is no turn");
}

#[test]
fn poses_at_one_time_or_long_ago_say_nothing() {
    let mut estimator = MotionEstimator::default();
    for (angle, at_s) in [(0.0, 1.0), (1.0, 1.0), (2.0, 9.0), (3.0, 3.0)] {
        assert!(estimator.see(round(angle), at_s).is_still(), "{at_s}");
    }
}

#[test]
fn a_hand_that_rests_has_stopped_three_frames_later() {
    let pixels = [0, 3, 4, 4, 9, 10, 14, 16, 16, 20];
    let at = |t_s: f64| round(f64::from(pixels[((t_s * 60.0).round() as usize).min(9)]) * 0.01);
    assert!(!told(at, 11).is_still() && !told(at, 12).is_still());
    assert!(told(at, 13).is_still());
}
