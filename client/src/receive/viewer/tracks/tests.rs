use protocol::held::Step as ToldStep;

use super::*;

/// Of an update's interval, in seconds.
const STEP_S: f64 = 1.0 / 30.0;

fn tracks(pose: impl Fn(f64) -> DAffine3, moments_s: &[f64]) -> Tracks {
    let mut tracks = Tracks::default();
    for &moment_s in moments_s {
        tracks.follow(&BTreeMap::from([(7, pose(moment_s))]), moment_s, &NextSteps::default());
    }
    tracks
}

/// How far the furthest of some points of the object is from where it should be, in metres.
fn off_m(at: &BTreeMap<u16, DAffine3>, truth: DAffine3) -> f64 {
    let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(-0.7)];
    points.map(|p| at[&7].transform_point3(p).distance(truth.transform_point3(p))).into_iter().fold(0.0, f64::max)
}

/// A point of a wheel that rolls, mirrored and half as large: far away, where only f64 tells millimetres.
fn rolling(t_s: f64) -> DAffine3 {
    let place = DAffine3::from_translation(DVec3::new(6e6, 40.0 * t_s, 0.0));
    place * DAffine3::from_rotation_z(9.0 * t_s) * DAffine3::from_scale(DVec3::new(-0.5, 0.5, 0.5))
}

/// On an arc, looking to its centre.
fn round(t_s: f64) -> DAffine3 {
    DAffine3::from_rotation_y(5.0 * t_s) * DAffine3::from_translation(DVec3::new(3.0, 0.2, 0.0))
}

#[test]
fn even_turns_lines_and_arcs_go_on_as_they_went() {
    let moments_s = [0.0, STEP_S, 2.0 * STEP_S];
    for steps in [-1.0, -0.6, -0.2, 0.0, 0.3, 0.8, 1.0] {
        let t_s = (2.0 + steps) * STEP_S;
        let off = off_m(&tracks(rolling, &moments_s).at(t_s), rolling(t_s));
        // A unit of the last place at six million metres is a nanometre, and the turn's axis is told from such numbers.
        assert!(off < 1e-6, "{off} m off after {steps} steps");
        // Chords of arcs have not quite the ratio of the arcs' lengths: a third order of the angle.
        let off = off_m(&tracks(round, &moments_s).at(t_s), round(t_s));
        let bound = 3.2 * (5.0 * STEP_S).powi(3) / 4.0;
        assert!(off < bound, "{off} m off after {steps} steps, {bound}");
        assert!(steps.fract() != 0.0 || off < 1e-12, "{off} m off at a moment that was told");
    }
}

#[test]
fn what_stretches_goes_on_evenly_too() {
    let grows = |t_s: f64| DAffine3::from_scale(DVec3::new(1.0 + t_s, 1.0, 1.0 - 2.0 * t_s));
    let growing = tracks(grows, &[0.0, 0.1, 0.2]);
    for t_s in [0.1, 0.17, 0.2, 0.26] {
        assert!(off_m(&growing.at(t_s), grows(t_s)) < 1e-12);
    }
    // From a point to a body, of which there is no inverse.
    let from_nothing = |t_s: f64| DAffine3::from_scale(DVec3::splat(t_s));
    let off = off_m(&tracks(from_nothing, &[0.0, 0.0, 0.1]).at(0.1), from_nothing(0.1));
    assert!(off < 1e-12, "{off}");
}

#[test]
fn nothing_goes_on_for_longer_than_it_was_seen_to_go() {
    let tracks = tracks(rolling, &[0.0, STEP_S, 2.0 * STEP_S]);
    assert_eq!(tracks.at(9.0), tracks.at(3.0 * STEP_S));
    assert_eq!(tracks.at(-9.0), tracks.at(STEP_S));
    assert!(off_m(&tracks.at(STEP_S), rolling(STEP_S)) < 1e-6);
}

#[test]
fn who_is_put_elsewhere_waits_there() {
    // A clip of a second that begins again.
    let clip = |t_s: f64| DAffine3::from_translation(DVec3::X * 2.0 * t_s.rem_euclid(1.0));
    let moments_s: Vec<f64> = (0..=30).map(|step| (f64::from(step) + 0.5) * STEP_S).collect();
    let begun_again = tracks(clip, &moments_s);
    // It came back by 1.93 m, 29 times as far as it goes in a step.
    for steps in [-0.5, 0.0, 0.5, 1.0] {
        let off =
            begun_again.at(moments_s[30] + steps * STEP_S)[&7].translation.distance(clip(moments_s[30]).translation);
        assert!(off <= 1.01 * 2.0 * STEP_S * STEP_S, "{off} m from where it begins");
    }
    let starts = |t_s: f64| DAffine3::from_translation(DVec3::X * if t_s > 0.1 { 5.0 } else { 0.0 });
    let started = tracks(starts, &[0.0, 0.1, 0.2]);
    assert_eq!(started.at(0.3)[&7], starts(0.2));
}

#[test]
fn who_turns_back_goes_on_the_new_way() {
    let lift = |t_s: f64| DAffine3::from_translation(DVec3::Y * (t_s - 0.2).abs());
    let tracks = tracks(lift, &[0.0, 0.1, 0.2, 0.3]);
    for t_s in [0.2, 0.27, 0.3, 0.34, 0.4] {
        assert!(off_m(&tracks.at(t_s), lift(t_s)) < 1e-12);
    }
}

#[test]
fn what_stops_or_is_told_again_at_the_same_moment_stands() {
    let mut tracks = tracks(rolling, &[0.0, STEP_S, 2.0 * STEP_S]);
    let there = BTreeMap::from([(7, rolling(2.0 * STEP_S))]);
    tracks.follow(&there, 2.0 * STEP_S, &NextSteps::default());
    assert!(off_m(&tracks.at(2.5 * STEP_S), rolling(2.5 * STEP_S)) < 1e-6, "it was told nothing new");
    tracks.follow(&there, 3.0 * STEP_S, &NextSteps::default());
    for t_s in [2.0 * STEP_S, 2.4 * STEP_S, 9.0] {
        assert_eq!(tracks.at(t_s), there);
    }
    // A clock that was set back begins anew; another object appears.
    tracks.follow(&there, 0.0, &NextSteps::default());
    assert_eq!(tracks.at(0.5), there);
    let two = BTreeMap::from([(7, rolling(0.0)), (8, DAffine3::IDENTITY)]);
    tracks.follow(&two, STEP_S, &NextSteps::default());
    assert_eq!(tracks.at(STEP_S), two);
    tracks.clear();
    assert!(tracks.at(0.0).is_empty());
}

/// The steps from a pose on, each of so many seconds, as a server tells them.
fn told(pose: impl Fn(f64) -> DAffine3, t_s: f64, step_s: f64) -> NextSteps {
    let step = |from_s: f64| {
        let (now, then) = (pose(from_s), pose(from_s + step_s));
        let turn_world = turn_of(&now.matrix3, &then.matrix3).expect("it does not stretch").as_vec3();
        ToldStep { way_world: (then.translation - now.translation).as_vec3(), turn_world }
    };
    let steps = [0.0, 1.0, 2.0].map(|steps| step(t_s + steps * step_s));
    NextSteps { step_s: step_s as f32, objects: vec![ObjectSteps { object: 7, steps }] }
}

#[test]
fn what_was_told_is_gone_exactly_and_then_for_as_long_again() {
    let step_s = 0.5 * STEP_S;
    for (pose, bound) in [(rolling as fn(f64) -> DAffine3, 1e-6), (round, 3.2 * (5.0 * step_s).powi(3) / 4.0)] {
        let mut tracks = tracks(pose, &[0.0, STEP_S, 2.0 * STEP_S]);
        let from_s = 2.0 * STEP_S;
        tracks.follow(&BTreeMap::from([(7, pose(from_s))]), from_s, &told(pose, from_s, step_s));
        for steps in [-0.5, 0.0, 0.2, 0.7, 1.0, 1.3, 1.9, 2.0, 2.4, 3.0, 3.4] {
            let t_s = from_s + steps * step_s;
            let off = off_m(&tracks.at(t_s), pose(t_s));
            assert!(off < bound, "{off} m off after {steps} steps, {bound}");
            // What f32 tells of ways of decimetres and turns of less than one.
            assert!(steps <= 0.0 || steps.fract() != 0.0 || off < 1e-6, "{off} m off where it was told to be");
        }
        assert_eq!(tracks.at(9.0), tracks.at(from_s + 4.001 * step_s));
    }
}

#[test]
fn a_blow_ends_where_it_was_told() {
    // A swing that stops at once, just after the last update.
    let swing = |t_s: f64| DAffine3::from_rotation_z(12.0 * t_s.min(0.21)) * DAffine3::from_translation(DVec3::Y);
    let mut swung = tracks(swing, &[0.1, 0.15, 0.2]);
    let truth = swing(0.245);
    assert!(off_m(&swung.at(0.245), truth) > 0.4, "it cannot be guessed");
    swung.follow(&BTreeMap::from([(7, swing(0.2))]), 0.2, &told(swing, 0.2, 0.025));
    assert!(off_m(&swung.at(0.245), truth) < 1e-6);
    // An even step instead of one that ends early is late by six tenths of 0.12 rad, at two metres.
    assert!(off_m(&swung.at(0.21), truth) < 0.15);
    // Told to stand, it stands; an update that tells nothing leaves it to guess again.
    let there = BTreeMap::from([(7, swing(0.25))]);
    swung.follow(&there, 0.25, &told(swing, 0.25, 0.025));
    assert_eq!(swung.at(0.4), there);
    swung.follow(&there, 0.25, &NextSteps::default());
    assert_ne!(swung.at(0.3), there);
}

#[test]
fn who_was_told_to_start_is_seen_to_go() {
    // From rest to full speed: a step that leads nowhere where it was not told.
    let starts = |t_s: f64| {
        let gone = (t_s - 0.1).max(0.0);
        DAffine3::from_translation(DVec3::X * 4.0 * gone) * DAffine3::from_rotation_y(6.0 * gone)
    };
    let then = BTreeMap::from([(7, starts(0.15))]);
    for (next, bound) in [(told(starts, 0.1, 0.025), 1e-6), (NextSteps::default(), 1.0)] {
        let mut started = tracks(starts, &[0.0, 0.05]);
        started.follow(&BTreeMap::from([(7, starts(0.1))]), 0.1, &next);
        started.follow(&then, 0.15, &NextSteps::default());
        let off = off_m(&started.at(0.125), starts(0.125));
        assert!(off < bound && (bound == 1e-6 || off > 0.1), "{off} m off halfway");
    }
}

#[test]
fn an_update_that_comes_late_is_gone_to_straight() {
    let mut late = tracks(rolling, &[0.0, STEP_S]);
    late.follow(&BTreeMap::from([(7, rolling(STEP_S))]), STEP_S, &told(rolling, STEP_S, STEP_S / 2.0));
    let line = |t_s: f64| DAffine3::from_translation(DVec3::X * t_s);
    late.follow(&BTreeMap::from([(7, line(1.0))]), 1.0, &NextSteps::default());
    let before = late.at(0.999)[&7].translation.distance(line(1.0).translation);
    assert!(before < 0.002 * rolling(STEP_S).translation.length(), "{before} m from where it is a moment later");
}

#[test]
fn steps_of_unknown_objects_are_nothing() {
    let mut tracks = tracks(round, &[0.0, STEP_S]);
    let mut next = told(round, STEP_S, STEP_S);
    next.objects[0].object = 8;
    tracks.follow(&BTreeMap::from([(7, round(STEP_S))]), STEP_S, &next);
    assert_eq!(tracks.at(STEP_S).len(), 1);
}
