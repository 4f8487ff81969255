//! A client has the scene put before it otherwise than others have: less of it, cut open, at another time.

mod common;

use std::collections::BTreeSet;
use std::sync::Arc;

use common::session::{INTERVAL_S, Session};
use common::witness::Witness;
use common::{ball_before_wall, coloured, moving_ball, scene, sphere, square, swing};
use glam::{DAffine3, DQuat, DVec3};
use protocol::message::Shadows;
use protocol::staging::{Excerpt, Parts, Playback, Section, Staging};
use protocol::{Held, PatchId, Purpose};
use vantage_server::plan::Reason;

const BALL: u16 = 1;

fn shows(parts: Parts) -> Staging {
    Staging { excerpt: Excerpt { parts, section: None }, ..Staging::default() }
}

fn plays(playback: Playback) -> Staging {
    Staging { playback, ..Staging::default() }
}

/// All objects that a copy shows in any way, to the eye, to lights or to mirrors. Images of reliefs and bodies show those that are placed.
fn objects(held: &Held) -> BTreeSet<u16> {
    let shared = |id: &PatchId, purpose: Purpose| held.bodies.contains_key(id) || matches!(purpose, Purpose::Relief(_));
    let patches = held.patches.iter().filter(|(id, held)| !shared(id, held.patch.purpose));
    let samples = patches.flat_map(|(_, held)| held.patch.image.object.iter().copied());
    samples.chain(held.instances.keys().map(|(object, _)| *object)).collect()
}

/// Where all samples of a copy are.
fn points(held: &Held) -> Vec<DVec3> {
    let of_patch = |image: &protocol::DepthImage| -> Vec<DVec3> {
        let place = |((x, y), code): ((u32, u32), &u16)| {
            let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let w = f64::from(image.depth_scale.w(*code));
            image.camera.world_from_image(camera::ImagePoint { u, v, w })
        };
        image.mask.occupied().zip(&image.depth).map(place).collect()
    };
    held.patches.values().flat_map(|held| of_patch(&held.patch.image)).collect()
}

#[test]
fn a_part_that_is_hidden_is_nowhere_and_what_it_hid_is_there() {
    let mut session = Session::new(ball_before_wall());
    session.client.draws.shadows = Shadows::Hard;
    session.settle();
    assert!(objects(&session.held).contains(&BALL));
    let eye = session.viewer.world_from_eye;
    session.client.stage(&shows(Parts::All.without(BALL)));
    session.settle();
    assert_eq!(objects(&session.held), BTreeSet::from([0]));
    let wall = DAffine3::from_translation(DVec3::Z * -4.0) * DAffine3::from_scale(DVec3::splat(8.0));
    let without = Arc::new(scene(vec![square(4, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &[(0, wall)]));
    let wrong = Witness::new(&session.gpu, &without, session.rules.near_m).wrong_share(&session.held, eye);
    assert!(wrong < 0.002, "{wrong}");

    session.client.stage(&shows(Parts::Only(vec![BALL])));
    session.settle();
    assert_eq!(objects(&session.held), BTreeSet::from([BALL]));

    session.client.stage(&Staging::default());
    session.settle();
    let wrong = session.witness().wrong_share(&session.held, eye);
    assert!(wrong < 0.01, "{wrong}");
}

#[test]
fn no_body_and_no_relief_shows_what_is_hidden() {
    let ball = |k: u32| {
        let at = DVec3::new(f64::from(k % 5) - 2.0, f64::from(k / 5) - 0.5, -3.7);
        (1, DAffine3::from_scale_rotation_translation(DVec3::splat(0.3), DQuat::IDENTITY, at))
    };
    let wall = (0, DAffine3::from_scale_rotation_translation(DVec3::splat(3.0), DQuat::IDENTITY, DVec3::Z * -4.0));
    let placed: Vec<_> = std::iter::once(wall).chain((0..10).map(ball)).collect();
    let balls = scene(vec![square(4, 0), sphere(24, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &placed);
    for mut session in [Session::new(balls.clone()).with_bodies(), Session::new(balls).with_reliefs()] {
        session.settle();
        let all = objects(&session.held);
        let (hidden, _) = *session.held.instances.keys().next().expect("an object that is shown so");
        session.client.stage(&shows(Parts::All.without(hidden)));
        session.settle();
        let left = objects(&session.held);
        assert!(!left.contains(&hidden) && left.len() + 1 == all.len(), "{left:?} of {all:?}");
    }
}

#[test]
fn a_mirror_shows_nothing_that_is_hidden() {
    let mut session = Session::built_in("mirror-teapots");
    session.ticks(12);
    let shown_by_mirrors = |held: &Held| -> BTreeSet<u16> {
        let of_mirrors = |purpose: Purpose| !matches!(purpose, Purpose::Eye | Purpose::Rest | Purpose::Light(_));
        let patches = held.patches.values().filter(|held| of_mirrors(held.patch.purpose));
        patches.flat_map(|held| held.patch.image.object.iter().copied()).collect()
    };
    let before = shown_by_mirrors(&session.held);
    let hidden = *before.first().expect("mirrors show something");
    session.client.stage(&shows(Parts::All.without(hidden)));
    session.ticks(12);
    let after = shown_by_mirrors(&session.held);
    assert!(!after.is_empty() && !after.contains(&hidden), "{hidden} of {before:?}: {after:?}");
}

#[test]
fn a_scene_is_cut_open_and_shows_its_inside() {
    let at = |z: f64, scale: f64| {
        DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::new(0.0, 0.0, z))
    };
    let materials = vec![coloured([0.6, 0.5, 0.4, 1.0])];
    let balls = scene(vec![square(4, 0), sphere(24, 0)], materials, &[(0, at(-4.0, 8.0)), (1, at(-2.5, 0.6))]);
    let mut session = Session::new(balls).with_bodies();
    session.client.draws.shadows = Shadows::Hard;
    // What is nearer than the ball's middle is not there.
    let section = Section { normal_world: DVec3::Z, offset_m: -2.5 };
    let staging = Staging { excerpt: Excerpt { section: Some(section), ..Excerpt::default() }, ..Staging::default() };
    session.client.stage(&staging);
    session.settle();
    let points = points(&session.held);
    let beyond = points.iter().filter(|point| point.z > -2.5 + 0.01).count();
    assert_eq!(beyond, 0, "of {}", points.len());
    // The farther half of the ball, from inside.
    let inside = |point: &&DVec3| (point.distance(DVec3::Z * -2.5) - 0.6).abs() < 0.02 && point.z < -2.8;
    assert!(points.iter().filter(inside).count() > 100);
    let of_ball = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Eye).flat_map(|held| {
        let image = &held.patch.image;
        let facing = |(index, object): (usize, &u16)| (*object == BALL).then(|| image.normal_at(index).z);
        image.object.iter().enumerate().filter_map(facing).collect::<Vec<_>>()
    });
    let away = of_ball.clone().filter(|z| *z < 0.0).count();
    assert_eq!(away, 0, "insides face the eye, of {}", of_ball.count());

    session.client.stage(&Staging::default());
    session.settle();
    assert!(session.held.instances.keys().any(|(object, _)| *object == BALL), "the ball is less as it is");
}

#[test]
fn time_stands_goes_elsewhere_and_on_at_another_rate_for_one_client_alone() {
    let mut session = Session::new(moving_ball(|time_s| swing(time_s, 4.0)));
    session.ticks(6);
    let pose = |session: &Session| session.held.poses_now[&BALL].translation.x;
    let there = |time_s: f64| swing(time_s, 4.0).translation.x;
    let paused = Playback::default().at_rate(0.0, session.now_s);
    session.client.stage(&plays(paused));
    session.ticks(6);
    assert_eq!(session.held.scene_time_s, paused.scene_time_s);
    assert!((pose(&session) - there(paused.scene_time_s)).abs() < 1e-3);
    let more: Vec<_> = (0..5).filter_map(|_| session.tick()).map(|made| (made.reason, made.counts)).collect();
    assert!(more.is_empty(), "what stands costs nothing: {more:?}");

    // Back in time.
    let earlier = paused.from(0.1, session.now_s);
    session.client.stage(&plays(earlier));
    session.ticks(6);
    assert_eq!(session.held.scene_time_s, 0.1);
    assert!((pose(&session) - there(0.1)).abs() < 1e-3);

    let begin_s = session.now_s;
    session.client.stage(&plays(earlier.at_rate(2.0, begin_s)));
    let times: Vec<f64> = (0..4).filter_map(|_| session.tick()).map(|made| made.update.scene_time_s).collect();
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.iter().all(|step_s| (step_s - 2.0 * INTERVAL_S).abs() < 1e-9), "{times:?}");
    // What is told ahead is told in the scene's time.
    let made = session.tick().expect("the scene moves on");
    assert!((f64::from(made.update.next.step_s) - INTERVAL_S).abs() < 1e-6, "{}", made.update.next.step_s);
    assert!((pose(&session) - there(session.held.scene_time_s)).abs() < 1e-3);
}

#[test]
fn who_stops_the_time_and_stands_still_is_sent_his_own_view() {
    let mut session = Session::resting("urban-moving");
    let start = session.viewer.world_from_eye;
    session.hear(start, DVec3::ZERO);
    session.ticks(4);
    let paused = Playback::default().at_rate(0.0, session.now_s);
    session.client.stage(&plays(paused));
    let reasons: Vec<Reason> = (0..12).filter_map(|_| session.tick()).map(|made| made.reason).collect();
    assert!(reasons.contains(&Reason::Rest), "{reasons:?}");
    let rows = |held: &Held| held.patches.values().filter(|held| held.patch.purpose == Purpose::Rest).count();
    assert!(session.tick().is_none() && rows(&session.held) > 0);
    session.client.stage(&plays(paused.at_rate(1.0, session.now_s)));
    session.tick().expect("the scene moves on");
    assert_eq!(rows(&session.held), 0);
}

/// Who stands within something sees its inside, and a step beside him there is its outside.
#[test]
fn what_is_cut_open_comes_to_an_end() {
    let at = |z: f64, scale: f64| DAffine3::from_translation(DVec3::Z * z) * DAffine3::from_scale(DVec3::splat(scale));
    let materials = vec![coloured([0.6, 0.5, 0.4, 1.0])];
    let around = scene(vec![square(4, 0), sphere(24, 0)], materials, &[(0, at(-4.0, 8.0)), (1, at(0.0, 0.24))]);
    let mut session = Session::new(around);
    let section = Section { normal_world: DVec3::Y, offset_m: 0.1 };
    let staging = Staging { excerpt: Excerpt { section: Some(section), ..Excerpt::default() }, ..Staging::default() };
    session.client.stage(&staging);
    session.settle();
}
