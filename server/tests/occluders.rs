//! What occludes that no eye saw, sent to clients that draw ambient occlusion.

mod common;

use std::collections::BTreeSet;

use common::session::Session;
use common::{coloured, scene, sphere, square};
use glam::{DAffine3, DVec3};
use protocol::image::octahedral_normal;
use protocol::message::Shadows;
use protocol::{DepthImage, Purpose};
use scene::Scene;

/// A viewer who draws occlusion by what is so near.
fn occluded(mut session: Session, reach_m: f64) -> Session {
    session.client.draws.occlusion_reach_m = reach_m;
    session
}

fn images(session: &Session, purpose: Purpose) -> Vec<&DepthImage> {
    let patches = session.held.patches.values().filter(|held| held.patch.purpose == purpose);
    patches.map(|held| &held.patch.image).collect()
}

/// Samples of an object that face along -z, away from the eye.
fn turned_away(images: &[&DepthImage], object: u16) -> usize {
    let of = |image: &&DepthImage| {
        let samples = image.object.iter().zip(&image.normal);
        samples.filter(|(of, normal)| **of == object && octahedral_normal(**normal).z < -0.2).count()
    };
    images.iter().map(of).sum()
}

fn placed(z: f64, scale: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::Z * z) * DAffine3::from_scale(DVec3::splat(scale))
}

/// A wall of three metres with a ball before it: object 1.
fn ball_before_wall() -> Scene {
    let placed = [(0, placed(-4.0, 1.5)), (1, placed(-3.2, 0.4))];
    scene(vec![square(4, 0), sphere(24, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &placed)
}

#[test]
fn what_the_eye_never_saw_is_sent_once() {
    let mut session = occluded(Session::new(ball_before_wall()), 1.0);
    session.tick();
    assert_eq!(turned_away(&images(&session, Purpose::Eye), 1), 0);
    let sent = images(&session, Purpose::Occluders);
    assert!(turned_away(&sent, 1) > 30, "the back of the ball: {}", turned_away(&sent, 1));
    assert!(sent.iter().all(|image| image.colour.iter().all(|colour| *colour == [0; 3])), "nobody sees colours");
    let later = session.ticks(10);
    assert!(later.iter().all(|counts| counts.occluders.added + counts.occluders.views == 0), "{later:?}");
}

#[test]
fn what_the_eye_holds_is_not_sent_for_occlusion_again() {
    let mut session = occluded(Session::new(ball_before_wall()), 1.0);
    session.tick();
    // Of the wall the eye saw all that is within reach of the ball, but for what the ball hides.
    let towards_eye = |image: &&DepthImage| {
        let samples = image.object.iter().zip(&image.normal);
        samples.filter(|(of, normal)| **of == 1 && octahedral_normal(**normal).z > 0.5).count()
    };
    let seen: usize = images(&session, Purpose::Eye).iter().map(towards_eye).sum();
    let again: usize = images(&session, Purpose::Occluders).iter().map(towards_eye).sum();
    assert!(20 * again < seen, "{again} of {seen} samples of the ball's front");
}

#[test]
fn in_the_open_nothing_is_sent() {
    let material = || vec![coloured([0.6, 0.5, 0.4, 1.0])];
    let ball = scene(vec![sphere(24, 0)], material(), &[(0, placed(-3.0, 0.5))]);
    let far_apart =
        scene(vec![square(4, 0), sphere(24, 0)], material(), &[(0, placed(-8.0, 8.0)), (1, placed(-3.0, 0.5))]);
    for alone in [ball, far_apart] {
        let mut session = occluded(Session::new(alone), 1.0);
        session.ticks(3);
        assert!(!images(&session, Purpose::Eye).is_empty());
        assert!(images(&session, Purpose::Occluders).is_empty(), "{}", images(&session, Purpose::Occluders).len());
    }
}

#[test]
fn who_draws_no_occlusion_is_sent_nothing() {
    for reach_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut session = occluded(Session::new(ball_before_wall()), reach_m);
        session.ticks(2);
        assert!(images(&session, Purpose::Occluders).is_empty(), "a reach of {reach_m} m");
    }
}

#[test]
fn for_what_is_not_lit_nothing_is_sent() {
    let mut unlit = ball_before_wall();
    unlit.materials.iter_mut().for_each(|material| material.unlit = true);
    let mut session = occluded(Session::new(unlit), 1.0);
    session.client.draws.shadows = Shadows::Soft;
    session.ticks(3);
    assert!(!images(&session, Purpose::Eye).is_empty());
    assert!(session.held.patches.values().all(|held| held.patch.purpose == Purpose::Eye));
    let left_out: Vec<_> = session.client.inventory.parts.iter().filter(|part| part.why == "nothing is lit").collect();
    assert_eq!(left_out.len(), 2, "{left_out:?}");
}

/// Balls that touch a wall.
fn balls_at_wall() -> Scene {
    let ball = |k: usize| {
        let at = DVec3::new((k % 5) as f64 - 2.0, (k / 5) as f64 - 0.5, -3.7);
        (1, DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(0.3)))
    };
    let wall = (0, DAffine3::from_translation(DVec3::Z * -4.0) * DAffine3::from_scale(DVec3::splat(3.0)));
    let placed: Vec<_> = std::iter::once(wall).chain((0..10).map(ball)).collect();
    scene(vec![square(4, 0), sphere(24, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &placed)
}

#[test]
fn what_reliefs_show_occludes() {
    let mut session = occluded(Session::new(balls_at_wall()).with_reliefs(), 0.5);
    session.settle();
    let by_reliefs: BTreeSet<u16> = session.held.instances.keys().map(|(object, _)| *object).collect();
    assert_eq!(by_reliefs.len(), 10);
    let sent = images(&session, Purpose::Occluders);
    for ball in by_reliefs {
        let count: usize = sent.iter().map(|image| image.object.iter().filter(|of| **of == ball).count()).sum();
        assert!(count > 8, "{count} samples of ball {ball}");
    }
}
