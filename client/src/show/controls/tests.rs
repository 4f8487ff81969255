use super::*;

fn walking() -> Controls {
    let start = Rigid::look_along(DVec3::new(0.0, 1.7, 5.0), DVec3::NEG_Z);
    let mut controls = Controls::new(start, true, DVec3::splat(-20.0), DVec3::splat(20.0));
    controls.set_view(DVec2::new(800.0, 600.0), 60_f64.to_radians());
    controls
}

fn orbiting() -> Controls {
    let start = Rigid::look_at(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO);
    let mut controls = Controls::new(start, false, DVec3::splat(-1.0), DVec3::splat(1.0));
    controls.set_view(DVec2::new(800.0, 600.0), 60_f64.to_radians());
    controls
}

fn key(key: Key, down: bool) -> Input {
    Input::Key { key, down }
}

fn drag(controls: &mut Controls, drag: Drag, from: (f64, f64), to: (f64, f64)) {
    controls.handle(Input::PointerDown { id: 1, drag, at_px: from.into() });
    controls.handle(Input::PointerMove { id: 1, at_px: to.into() });
    controls.handle(Input::PointerUp { id: 1 });
}

fn forward(controls: &Controls) -> DVec3 {
    controls.pose().transform_vector(DVec3::Z)
}

#[test]
fn begins_at_the_start_pose() {
    for (start, walk) in [
        (Rigid::look_along(DVec3::new(3.0, 1.7, 5.0), DVec3::new(0.3, -0.2, -1.0)), true),
        (Rigid::look_at(DVec3::new(2.0, 1.0, 4.0), DVec3::ZERO), false),
    ] {
        let controls = Controls::new(start, walk, DVec3::splat(-1.0), DVec3::splat(1.0));
        let pose = controls.pose();
        assert!(pose.translation.distance(start.translation) < 1e-9);
        assert!(pose.rotation.angle_between(start.rotation) < 1e-6);
    }
}

/// Lets seconds pass, frame by frame.
fn pass(controls: &mut Controls, seconds: f64) {
    for _ in 0..(seconds * 60.0) as usize {
        controls.advance(1.0 / 60.0);
    }
}

#[test]
fn it_goes_to_where_all_is_seen() {
    for mut controls in [walking(), orbiting()] {
        let [min, max] = controls.bounds_world;
        for (side, along) in [
            (Side::Same, forward(&controls)),
            (Side::Front, DVec3::NEG_Z),
            (Side::Right, DVec3::NEG_X),
            (Side::Top, DVec3::NEG_Y),
        ] {
            controls.go_to(side);
            assert!(controls.advance(0.01), "it moves by itself");
            pass(&mut controls, 3.0);
            assert!(!controls.advance(0.01), "it is there");
            assert!(forward(&controls).angle_between(along) < 0.03, "{side:?}: {}", forward(&controls));
            let camera = camera::Pinhole::symmetric(controls.pose(), (800, 600), 60_f64.to_radians(), 1e-3);
            let corners = (0..8).map(|index: usize| {
                DVec3::from_array([0, 1, 2].map(|axis| if index >> axis & 1 == 0 { min[axis] } else { max[axis] }))
            });
            let places: Vec<_> =
                corners.map(|corner| camera.image_from_world(corner).expect("before the eye")).collect();
            assert!(places.iter().all(|&place| camera.contains(place)), "{side:?}: {places:?}");
            let reach =
                places.iter().map(|place| ((place.u - 400.0) / 400.0).abs().max(((place.v - 300.0) / 300.0).abs()));
            assert!((reach.fold(0.0, f64::max) - 0.9).abs() < 1e-3, "{side:?}: {places:?}");
        }
        // Who turns afterwards turns about the middle.
        controls.set_mode(Mode::Orbit);
        drag(&mut controls, Drag::Look, (0.0, 0.0), (200.0, 0.0));
        let ahead = controls.pose().translation + forward(&controls) * controls.distance_m();
        assert!(ahead.distance((min + max) / 2.0) < 1e-3 * (max - min).length(), "{ahead}");
    }
}

#[test]
fn it_goes_to_a_point_unless_the_person_moves() {
    let point = DVec3::new(0.5, 0.5, 0.5);
    let ahead = |controls: &Controls| controls.pose().translation + forward(controls) * controls.distance_m();
    for mut controls in [walking(), orbiting()] {
        let before = controls.clone();
        let was_m = before.pose().translation.distance(point);
        controls.visit(point);
        pass(&mut controls, 3.0);
        assert!(ahead(&controls).distance(point) < 1e-3, "it looks at it");
        match controls.mode() {
            Mode::Walk => assert!((controls.pose().translation.distance(point) / was_m - 0.35).abs() < 1e-3),
            Mode::Orbit => assert!(forward(&controls).angle_between(forward(&before)) < 1e-6, "from where it did"),
        }
        controls.visit(DVec3::ZERO);
        pass(&mut controls, 0.1);
        controls.handle(Input::Wheel { notches: 0.0 });
        let here = controls.pose();
        pass(&mut controls, 1.0);
        assert_eq!(controls.pose(), here);
    }
}

#[test]
fn a_person_sets_the_speed() {
    let way = |share: f64| {
        let mut controls = walking();
        controls.change_speed(share);
        controls.handle(key(Key::Forward, true));
        pass(&mut controls, 2.0);
        controls.pose().translation.distance(walking().pose().translation)
    };
    assert!((way(4.0) / way(1.0) - 4.0).abs() < 1e-9 && (way(0.25) / way(1.0) - 0.25).abs() < 1e-9);
    assert!(way(1e9).is_finite() && way(0.0) > 0.0);
}

#[test]
fn keys_give_the_same_path_at_every_frame_rate() {
    for mut coarse in [walking(), orbiting()] {
        let mut fine = coarse.clone();
        for (pressed, down) in [(Key::Forward, true), (Key::Right, true), (Key::Forward, false), (Key::Right, false)] {
            coarse.handle(key(pressed, down));
            fine.handle(key(pressed, down));
            for _ in 0..2 {
                coarse.advance(0.2);
            }
            for _ in 0..80 {
                fine.advance(0.005);
            }
        }
        assert!(coarse.pose().translation.distance(fine.pose().translation) < 1e-9);
        assert!(coarse.pose().translation.distance(walking().pose().translation) > 0.5, "it must have moved");
    }
}

#[test]
fn walking_forward_follows_the_ground_even_when_looking_down() {
    let mut controls = walking();
    drag(&mut controls, Drag::Look, (400.0, 500.0), (400.0, 100.0));
    assert!(forward(&controls).y < -0.3, "dragging the picture up looks down");
    let before = controls.pose().translation;
    controls.handle(key(Key::Forward, true));
    for _ in 0..10 {
        controls.advance(0.1);
    }
    let way = controls.pose().translation - before;
    assert!(way.y.abs() < 1e-12 && way.z < -1.0, "{way}");
}

#[test]
fn a_dragged_point_stays_under_the_pointer_when_walking() {
    let mut controls = walking();
    let right_of_middle = camera::Pinhole::symmetric(controls.pose(), (800, 600), 60_f64.to_radians(), 0.1);
    let far = right_of_middle.world_from_image(camera::ImagePoint { u: 402.0, v: 300.0, w: 1e-6 });
    drag(&mut controls, Drag::Look, (402.0, 300.0), (400.0, 300.0));
    let after = camera::Pinhole::symmetric(controls.pose(), (800, 600), 60_f64.to_radians(), 0.1);
    let shown = after.image_from_world(far).expect("in front");
    assert!((shown.u - 400.0).abs() < 0.5, "{shown:?}");
}

#[test]
fn orbiting_keeps_the_distance_and_looks_at_the_pivot() {
    let mut controls = orbiting();
    let distance = controls.pose().translation.length();
    drag(&mut controls, Drag::Look, (100.0, 100.0), (500.0, 40.0));
    controls.handle(key(Key::Left, true));
    controls.advance(0.2);
    let pose = controls.pose();
    assert!((pose.translation.length() - distance).abs() < 1e-9);
    assert!(forward(&controls).dot(-pose.translation.normalize()) > 1.0 - 1e-9);
    assert!(pose.translation.distance(orbiting().pose().translation) > 0.5);
}

#[test]
fn dragging_right_turns_the_object_right() {
    let mut controls = orbiting();
    let before = controls.pose().translation;
    drag(&mut controls, Drag::Look, (400.0, 300.0), (500.0, 300.0));
    assert!(controls.pose().translation.x < before.x - 0.5, "the eye goes left");
}

#[test]
fn the_wheel_goes_nearer_and_never_through() {
    let mut controls = orbiting();
    controls.handle(Input::Wheel { notches: 1e6 });
    let nearest = controls.pose().translation.length();
    assert!(nearest > 0.0 && nearest < 0.01);
    controls.handle(Input::Wheel { notches: f64::NAN });
    controls.handle(Input::Wheel { notches: -1e6 });
    assert!(controls.pose().translation.is_finite());
    let mut controls = walking();
    controls.handle(Input::Wheel { notches: 1.0 });
    assert!(controls.pose().translation.z < 5.0);
}

#[test]
fn pitch_stops_short_of_the_vertical() {
    let mut controls = walking();
    for _ in 0..20 {
        drag(&mut controls, Drag::Look, (0.0, 0.0), (0.0, 600.0));
    }
    assert!(forward(&controls).y > 0.99);
    assert!(controls.pose().is_valid());
}

#[test]
fn two_fingers_pinch_and_move() {
    let mut controls = orbiting();
    let down = |id, x: f64| Input::PointerDown { id, drag: Drag::Look, at_px: DVec2::new(x, 300.0) };
    controls.handle(down(7, 300.0));
    controls.handle(down(8, 500.0));
    controls.handle(Input::PointerMove { id: 7, at_px: DVec2::new(200.0, 300.0) });
    controls.handle(Input::PointerMove { id: 8, at_px: DVec2::new(600.0, 300.0) });
    let pose = controls.pose();
    // The fingers move one after the other, so the middle sways a little on the way.
    let off = pose.translation - orbiting().pose().translation / 2.0;
    assert!(
        off.y.abs() < 1e-9 && off.z.abs() < 1e-9 && off.x.abs() < 0.2,
        "twice the spread is half the distance: {off}"
    );
    let before = controls.pose();
    controls.handle(Input::PointerMove { id: 7, at_px: DVec2::new(260.0, 300.0) });
    controls.handle(Input::PointerMove { id: 8, at_px: DVec2::new(660.0, 300.0) });
    let way = controls.pose().translation - before.translation;
    assert!(way.x < -0.05, "moving both to the right moves the eye to the left: {way}");
    // A lifted finger leaves one that looks again.
    controls.handle(Input::PointerUp { id: 8 });
    let before = controls.pose();
    controls.handle(Input::PointerMove { id: 7, at_px: DVec2::new(360.0, 300.0) });
    assert!(controls.pose().rotation.angle_between(before.rotation) > 0.1);
}

#[test]
fn losing_the_focus_releases_everything() {
    let mut controls = walking();
    controls.handle(key(Key::Forward, true));
    assert!(controls.advance(0.1));
    controls.handle(Input::FocusLost);
    for _ in 0..100 {
        controls.advance(0.1);
    }
    let stopped = controls.pose();
    assert!(!controls.advance(0.1));
    assert_eq!(controls.pose(), stopped);
}

#[test]
fn switching_the_mode_keeps_the_eye() {
    let mut controls = walking();
    drag(&mut controls, Drag::Look, (0.0, 0.0), (50.0, 30.0));
    let before = controls.pose();
    controls.set_mode(Mode::Orbit);
    assert!(controls.pose().translation.distance(before.translation) < 1e-9);
    controls.set_mode(Mode::Walk);
    assert!(controls.pose().translation.distance(before.translation) < 1e-9);
}

#[test]
fn shift_is_faster() {
    let (mut slow, mut fast) = (walking(), walking());
    fast.handle(key(Key::Fast, true));
    for controls in [&mut slow, &mut fast] {
        controls.handle(key(Key::Forward, true));
        controls.advance(0.2);
    }
    assert!((5.0 - fast.pose().translation.z) > 3.0 * (5.0 - slow.pose().translation.z));
}

#[test]
fn the_motion_that_keys_say_is_where_the_eye_goes() {
    for mut controls in [walking(), orbiting()] {
        assert_eq!(controls.motion(), None, "at rest");
        for (pressed, down) in [(Key::Right, true), (Key::Up, true), (Key::Right, false), (Key::Up, false)] {
            controls.handle(key(pressed, down));
            // Held keys have come up to speed by then.
            if down {
                (0..10).for_each(|_| _ = controls.advance(0.1));
            }
            if (pressed, down) == (Key::Right, false) {
                continue; // From both keys to one: neither even nor fading.
            }
            let expected = controls.motion().expect("keys move it").pose_after(&controls.pose(), 0.1);
            let before = controls.pose();
            controls.advance(0.1);
            let pose = controls.pose();
            let (off_m, way_m) =
                (pose.translation.distance(expected.translation), pose.translation.distance(before.translation));
            assert!(off_m < 0.05 * way_m, "{:?} {pressed:?} {down}: {off_m} of {way_m}", controls.mode());
            assert!(pose.rotation.angle_between(expected.rotation) < 0.01);
        }
        controls.handle(Input::PointerDown { id: 1, drag: Drag::Look, at_px: DVec2::ZERO });
        assert_eq!(controls.motion(), None, "a pointer may do anything");
    }
}

#[test]
fn an_eye_is_led_until_the_person_moves_it() {
    let there = Rigid::look_at(DVec3::new(3.0, 2.0, -1.0), DVec3::new(0.0, 1.0, 4.0));
    let further = Rigid::look_at(DVec3::new(-3.0, 2.5, -1.0), DVec3::new(0.0, 1.0, 4.0));
    let is_at = |controls: &Controls, pose: Rigid| {
        controls.pose().translation.abs_diff_eq(pose.translation, 1e-6)
            && forward(controls).abs_diff_eq(pose.transform_vector(DVec3::Z), 1e-6)
    };
    for mut controls in [walking(), orbiting()] {
        let begun = controls.pose();
        controls.lead_to(there);
        assert_eq!(controls.pose(), begun, "nobody asked to be led");
        controls.be_led();
        controls.lead_to(there);
        assert!(is_at(&controls, there), "at first it leaps");
        controls.lead_to(further);
        controls.advance(0.1);
        assert!(!is_at(&controls, there) && !is_at(&controls, further), "then it goes");
        for _ in 0..40 {
            controls.lead_to(further);
            controls.advance(0.1);
        }
        let arrived = controls.pose();
        controls.lead_to(further);
        controls.advance(0.1);
        assert_eq!(controls.pose(), arrived, "there it rests");
        assert!(is_at(&controls, further));
        drag(&mut controls, Drag::Look, (400.0, 300.0), (420.0, 300.0));
        assert!(!controls.is_led());
        controls.lead_to(there);
        controls.advance(1.0);
        assert!(controls.pose().translation.distance(there.translation) > 1.0, "it stays where the person took it");
    }
}

#[test]
fn a_drag_that_is_let_go_glides_on_and_comes_to_rest_alike_at_every_frame_rate() {
    let glided = |frames_a_s: f64, waits_s: f64| {
        let mut controls = Controls::new(Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), true, -DVec3::ONE, DVec3::ONE);
        controls.handle(Input::PointerDown { id: 1, drag: Drag::Look, at_px: DVec2::ZERO });
        let dt_s = 1.0 / frames_a_s;
        let frames = (0.3 * frames_a_s).round();
        for frame in 1..=frames as u32 {
            // 500 pixels a second.
            controls.handle(Input::PointerMove { id: 1, at_px: DVec2::new(500.0 * dt_s * f64::from(frame), 0.0) });
            controls.advance(dt_s);
        }
        for _ in 0..(waits_s * frames_a_s) as u32 {
            controls.advance(dt_s);
        }
        controls.handle(Input::PointerUp { id: 1 });
        let before = controls.yaw_rad;
        let mut moving = 0;
        while controls.advance(dt_s) {
            moving += 1;
            assert!(f64::from(moving) < 3.0 * frames_a_s, "it does not end");
        }
        (controls.yaw_rad - before) / (controls.fov_y_rad / controls.size_px.y)
    };
    let [slow_px, fast_px] = [30.0, 120.0].map(|frames_a_s| glided(frames_a_s, 0.0));
    assert!((60.0..80.0).contains(&fast_px), "{fast_px}: 500 pixels a second fade within 0.15 s");
    assert!((slow_px - fast_px).abs() < 5.0, "{slow_px} and {fast_px}");
    assert!(glided(60.0, 0.3).abs() < 1.0, "who holds still throws nothing");
}

fn second(controls: &mut Controls) {
    for _ in 0..60 {
        controls.advance(1.0 / 60.0);
    }
}

#[test]
fn sticks_move_and_look_and_three_fingers_lift() {
    let start = Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z);
    let mut controls = Controls::new(start, true, -10.0 * DVec3::ONE, 10.0 * DVec3::ONE);
    controls.handle(Input::Sticks { go: DVec3::new(0.0, 0.0, 0.5), look: DVec2::ZERO });
    second(&mut controls);
    let half_m = -controls.pose().translation.z;
    let full_m = controls.speed_m_s * (1.0 - SMOOTHING_S);
    assert!((half_m - full_m / 2.0).abs() < 0.02 * full_m, "{half_m} of {full_m}");
    controls.handle(Input::Sticks { go: DVec3::ZERO, look: DVec2::new(1.0, 0.0) });
    assert!(controls.advance(0.1), "it goes on while a stick is held");
    assert!(controls.forward().x > 0.1, "to the right");
    controls.handle(Input::Sticks { go: DVec3::ZERO, look: DVec2::ZERO });
    second(&mut controls);
    assert!(!controls.advance(0.1));
    let before = controls.pose();
    for id in 0..3 {
        controls.handle(Input::PointerDown { id, drag: Drag::Look, at_px: DVec2::new(100.0 * id as f64, 0.0) });
    }
    (0..3).for_each(|id| controls.handle(Input::PointerMove { id, at_px: DVec2::new(100.0 * id as f64, 60.0) }));
    let lifted = controls.pose().translation - before.translation;
    assert!(
        lifted.y > 0.1 && (lifted - DVec3::Y * lifted.y).length() < 1e-9,
        "{lifted}: dragged down, the eye goes up"
    );
    assert_eq!(controls.pose().rotation, before.rotation);
}

#[test]
fn a_wall_stops_who_walks_and_nobody_who_turns_walls_off() {
    let gone = |are_on: bool| {
        let mut controls = walking();
        controls.set_walls(are_on);
        assert_eq!(controls.feels(), None, "who stands meets nothing");
        controls.handle(key(Key::Forward, true));
        pass(&mut controls, 0.1);
        let felt = controls.feels();
        assert_eq!(felt.is_some(), are_on);
        if let Some(((eye, way), body_m)) = felt {
            assert!(way.distance(DVec3::NEG_Z) < 1e-9 && (0.1..0.5).contains(&body_m) && eye.y == 1.7);
        }
        controls.meet(Some(Wall { point_world: DVec3::new(0.0, 1.7, 3.0), normal_world: DVec3::Z }));
        pass(&mut controls, 3.0);
        (controls.pose().translation.z, controls.motion().map_or(0.0, |motion| motion.speed_m_s(0.0)))
    };
    let (stopped_m, speed_m_s) = gone(true);
    assert!((3.1..3.5).contains(&stopped_m) && speed_m_s < 1e-6, "{stopped_m} m, {speed_m_s} m/s");
    assert!(gone(false).0 < 2.0);
}
