//! What a viewer will need next is sent while nobody needs anything, comes to an end, and is there when he moves.

mod common;

use std::f64::consts::PI;

use camera::{Motion, Rigid};
use common::session::Session;
use glam::{DQuat, DVec3};
use vantage_server::account::BYTES_PER_SAMPLE;
use vantage_server::frame::Made;
use vantage_server::plan::Reason;

/// Longer than anything is looked ahead for: each of 90 views at its own tick.
const TICKS: usize = 120;

fn run(session: &mut Session) -> Vec<Made> {
    let made: Vec<Made> = (0..TICKS).filter_map(|_| session.tick()).collect();
    assert!((0..TICKS).all(|_| session.tick().is_none()), "nothing more is sent, ever");
    made
}

fn ahead(made: &[Made]) -> usize {
    made.iter().filter(|made| made.reason == Reason::Ahead).map(|made| made.counts.ahead).sum()
}

/// The start pose turned about the scene's middle.
fn round(session: &Session, angle: f64) -> Rigid {
    let (start, middle) = (session.viewer.world_from_eye, session.scene.bounds.centre());
    let turn = DQuat::from_rotation_y(angle);
    Rigid { rotation: (turn * start.rotation).normalize(), translation: middle + turn * (start.translation - middle) }
}

#[test]
fn round_an_object_there_is_no_hole_once_it_ended() {
    let mut session = Session::anticipating("teapots");
    let made = run(&mut session);
    assert_eq!(made[0].reason, Reason::First, "his own view comes first");
    let first_ahead = made.iter().position(|made| made.reason == Reason::Ahead).expect("looked ahead");
    assert!(made[first_ahead..].iter().all(|made| made.reason == Reason::Ahead), "and what it lacks");
    assert!(ahead(&made) > 1000, "{} samples", ahead(&made));
    let mut witness = session.witness();
    // Between views of the ring too.
    let holes: Vec<f64> = (0..24)
        .map(|step| witness.holes_share(&session.held, round(&session, PI / 12.0 * f64::from(step) + 0.1)))
        .collect();
    println!("teapots: {} samples ahead, {} bytes, holes {holes:.4?}", ahead(&made), session.sent_bytes);
    assert!(holes.iter().all(|&holes| holes <= 0.015), "{holes:?}");

    let mut without = Session::built_in("teapots");
    run(&mut without);
    let mut witness = without.witness();
    let behind = witness.holes_share(&without.held, round(&without, PI));
    assert!(behind > 0.05, "without it the far side is missing: {behind}");
}

#[test]
fn who_walks_is_sent_what_is_around_him_and_ahead() {
    let mut session = Session::anticipating("pillars");
    let made = run(&mut session);
    let mut witness = session.witness();
    let start = session.viewer.world_from_eye;
    let forward = start.transform_vector(DVec3::Z);
    let mut worst = 0.0_f64;
    for step in 0..12 {
        let turned = Rigid { rotation: DQuat::from_rotation_y(PI / 6.0 * f64::from(step)) * start.rotation, ..start };
        worst = worst.max(witness.holes_share(&session.held, turned));
    }
    let ahead_m = DVec3::new(forward.x, 0.0, forward.z).normalize() * 1.1;
    let walked = witness.holes_share(&session.held, Rigid { translation: start.translation + ahead_m, ..start });
    println!(
        "pillars: {} samples ahead, {} bytes, holes {worst} round, {walked} ahead",
        ahead(&made),
        session.sent_bytes
    );
    assert!(worst <= 0.015 && walked <= 0.015, "{worst} {walked}");
}

#[test]
fn who_begins_to_move_gets_his_own_view_at_once() {
    let mut session = Session::anticipating("teapots");
    while session.tick().is_none_or(|made| made.reason != Reason::Ahead) {}
    let (start, middle) = (session.viewer.world_from_eye, session.scene.bounds.centre());
    session.hear_motion(start, Motion::about(middle, start.translation, DVec3::Y));
    let made = session.tick().expect("what comes into view");
    assert!(matches!(made.reason, Reason::Moved | Reason::Turned), "{:?}", made.reason);
}

#[test]
fn a_slow_path_gets_little_at_a_time() {
    let mut session = Session::anticipating("teapots");
    while session.tick().is_none_or(|made| made.reason != Reason::Ahead) {}
    session.viewer.bytes_per_s = Some(625e3);
    let mut sizes = Vec::new();
    for _ in 0..40 {
        let before = session.sent_bytes;
        if session.tick().is_some_and(|made| made.reason == Reason::Ahead) {
            sizes.push(session.sent_bytes - before);
        }
    }
    println!("{sizes:?}");
    assert!(sizes.len() > 4 && sizes.iter().all(|&bytes| bytes < 31_250), "half an interval's: {sizes:?}");
}

#[test]
fn a_full_budget_ends_it_and_nothing_seen_goes_for_it() {
    let mut own = Session::built_in("teapots");
    run(&mut own);
    let own_samples = own.held.sample_count();
    let mut session = Session::anticipating("teapots");
    session.client.budget_bytes = own_samples as u64 * 2 * BYTES_PER_SAMPLE;
    let made = run(&mut session);
    assert!(ahead(&made) > 0 && made.iter().all(|made| made.counts.evicted == 0));
    assert!(session.held.sample_count() <= own_samples * 2);
    let mut witness = session.witness();
    let (with, without) = (
        witness.wrong_share(&session.held, session.viewer.world_from_eye),
        witness.wrong_share(&own.held, own.viewer.world_from_eye),
    );
    assert!(with <= without + 0.002, "his own view stays as it is: {with} for {without}");
}

#[test]
fn off_is_silence() {
    let mut session = Session::built_in("teapots");
    let made = run(&mut session);
    assert_eq!(ahead(&made), 0);
}
