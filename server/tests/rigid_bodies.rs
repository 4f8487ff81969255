//! What is rigid and less as its triangles is sent so, hides what lies behind it, and is never lacking.

mod common;

use std::collections::BTreeSet;

use common::session::Session;
use common::{animated, coloured, scene, square};
use glam::{DAffine3, DQuat, DVec3};
use protocol::Purpose;
use scene::Scene;

/// The board's half side, and how far it and the wall are.
const HALF_M: f64 = 0.8;
const BOARD_M: f64 = 2.0;
const WALL_M: f64 = 4.0;
const BOARD: u16 = 0;

/// A board of two triangles before a wall of so many that samples of it are less.
fn board_before_wall() -> Scene {
    let at = |z: f64, scale: f64| {
        DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::Z * z)
    };
    let materials = vec![coloured([0.6, 0.5, 0.4, 1.0]), coloured([0.2, 0.5, 0.8, 1.0])];
    let placed = [(0, at(-BOARD_M, HALF_M)), (1, at(-WALL_M, 8.0))];
    scene(vec![square(1, 0), square(200, 1)], materials, &placed)
}

/// Samples for the eye: of which object, and where they are in world space.
fn samples(session: &Session) -> Vec<(u16, DVec3)> {
    let eye = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Eye);
    let of_patch = |held: &protocol::held::HeldPatch| {
        let image = &held.patch.image;
        let at = |(index, (x, y)): (usize, (u32, u32))| {
            let (u, v, w) = (f64::from(x) + 0.5, f64::from(y) + 0.5, image.depth_scale.w(image.depth[index]));
            let point = camera::ImagePoint { u, v, w: w.into() };
            (image.object[index], image.camera.world_from_image(point))
        };
        image.mask.occupied().enumerate().map(at).collect::<Vec<_>>()
    };
    eye.flat_map(of_patch).collect()
}

/// How many samples of the wall lie where the board hides it from everywhere in the viewer's region.
fn behind_the_board(session: &Session) -> usize {
    let reach_m = HALF_M * WALL_M / BOARD_M - session.rules.margin_m * 2.0;
    let is_behind = |(object, p): &(u16, DVec3)| *object != BOARD && p.x.abs() < reach_m && p.y.abs() < reach_m;
    samples(session).iter().filter(|sample| is_behind(sample)).count()
}

fn objects(session: &Session) -> BTreeSet<u16> {
    samples(session).into_iter().map(|(object, _)| object).collect()
}

#[test]
fn a_board_is_sent_as_it_is_and_what_it_hides_is_not_sent() {
    let mut sampled = Session::small(board_before_wall(), 2);
    sampled.ticks(8);
    assert_eq!((sampled.held.bodies.len(), objects(&sampled)), (0, BTreeSet::from([0, 1])));
    for gpu in [false, true] {
        let session = Session::small(board_before_wall(), 2);
        let session = if gpu { session.comparing_on_gpu() } else { session };
        let mut session = session.with_bodies();
        session.ticks(8);
        assert_eq!((session.held.bodies.len(), objects(&session)), (1, BTreeSet::from([1])), "on a GPU: {gpu}");
        assert_eq!(behind_the_board(&session), 0);
        let sent_bytes = session.sent_bytes;
        session.ticks(4);
        assert_eq!(session.sent_bytes, sent_bytes, "nothing lacks any more");
    }
}

#[test]
fn what_comes_to_lie_behind_a_body_is_not_taken_for_false_cover() {
    for gpu in [false, true] {
        let session = Session::small(board_before_wall(), 2);
        let session = if gpu { session.comparing_on_gpu() } else { session };
        let mut session = session.with_bodies();
        session.settle();
        let seen = session.held.sample_count();
        let aside = camera::Rigid::look_along(DVec3::new(1.0, 0.3, 0.0), DVec3::NEG_Z);
        let mut counts = session.walk_to(aside, 8);
        counts.extend(session.settle());
        assert!(session.held.sample_count() > seen + 20, "the wall beside the board comes into view");
        let trimmed: usize = counts.iter().map(|counts| counts.trimmed).sum();
        // Outlines of what is held are trimmed by pixels.
        assert!(trimmed < 60, "on a GPU: {gpu}: {trimmed} samples trimmed");
    }
}

#[test]
fn what_a_body_hid_is_sent_when_it_has_gone() {
    let mut scene = board_before_wall();
    scene.instances[usize::from(BOARD)].moves = true;
    let away = |time_s: f64| DVec3::new((time_s - 0.6).clamp(0.0, 1.0) * 6.0, 0.0, -BOARD_M);
    let scene = animated(scene, move |snapshot| {
        snapshot.world_from_mesh[usize::from(BOARD)].translation = away(snapshot.time_s);
    });
    let mut session = Session::small(scene, 2).with_bodies();
    session.ticks(4);
    assert_eq!((session.held.bodies.len(), behind_the_board(&session)), (1, 0));
    session.ticks(20);
    assert_eq!(session.held.poses_now[&BOARD].translation, away(10.0), "it went");
    assert!(behind_the_board(&session) > 400, "{} samples of what it hid", behind_the_board(&session));
    assert_eq!(objects(&session), BTreeSet::from([1]), "none of the board itself");
}

#[test]
fn where_all_in_view_goes_as_triangles_no_view_is_drawn() {
    let board = |z: f64| DAffine3::from_scale_rotation_translation(DVec3::splat(HALF_M), DQuat::IDENTITY, DVec3::Z * z);
    // A wall that samples are less for stands behind the viewer.
    let materials = vec![coloured([0.6, 0.5, 0.4, 1.0]), coloured([0.2, 0.5, 0.8, 1.0])];
    let placed = [(0, board(-BOARD_M)), (1, DAffine3::from_rotation_y(std::f64::consts::PI) * board(-WALL_M))];
    let mut session = Session::small(scene(vec![square(1, 0), square(200, 1)], materials, &placed), 2).with_bodies();
    let first = session.tick().expect("the board is sent");
    assert_eq!((first.pixels, session.held.bodies.len(), objects(&session)), (0, 1, BTreeSet::new()));
    session.walk_to(camera::Rigid::look_along(DVec3::ZERO, DVec3::Z), 8);
    assert_eq!(objects(&session), BTreeSet::from([1]), "the wall came into view");
}

#[test]
fn bodies_of_one_mesh_are_one_wherever_they_stand() {
    let place = |x: f64, scale: DVec3| {
        DAffine3::from_scale_rotation_translation(scale, DQuat::from_rotation_y(0.3 * x), DVec3::new(x, 0.0, -2.0))
    };
    let (even, mirrored) = (DVec3::splat(0.4), DVec3::new(-0.3, 0.5, 0.4));
    let placed = [(0, place(-0.7, even)), (0, place(0.7, mirrored)), (0, place(40.0, even))];
    let scene = scene(vec![square(1, 0)], vec![coloured([0.6, 0.5, 0.4, 1.0])], &placed);
    let world_from_mesh = scene.at(0.0).world_from_mesh;
    let mut session = Session::small(scene, 2).with_bodies();
    session.ticks(4);
    assert_eq!(session.held.bodies.len(), 1);
    let shown: Vec<u16> = session.held.instances.keys().map(|(object, _)| *object).collect();
    assert_eq!(shown, [0, 1], "what is out of sight is not placed");
    for ((object, _), instance) in &session.held.instances {
        assert_eq!(instance.world_from_object, world_from_mesh[usize::from(*object)]);
    }
}
