//! A viewer who stands still is sent his own view, once; who moves on gives it back.

mod common;

use common::session::Session;
use glam::DVec3;
use protocol::message::ViewSize;
use protocol::{Held, Purpose};
use vantage_server::frame::Made;
use vantage_server::plan::Reason;

/// Rows and samples of views at rest.
fn at_rest(held: &Held) -> (u32, usize) {
    let patches = held.patches.values().filter(|held| held.patch.purpose == Purpose::Rest);
    patches.fold((0, 0), |(rows, samples), held| {
        (rows + held.patch.image.mask.size_px().1, samples + held.patch.image.sample_count())
    })
}

/// Longer than any viewer who stands still is looked for.
const TICKS: usize = 20;

fn all(session: &mut Session) -> Vec<Made> {
    (0..TICKS).filter_map(|_| session.tick()).collect()
}

#[test]
fn the_own_view_comes_once_and_goes_with_the_viewer() {
    let mut session = Session::resting("pillars");
    let start = session.viewer.world_from_eye;
    session.hear(start, DVec3::ZERO);
    let made = all(&mut session);
    let rests = made.iter().filter(|made| made.reason == Reason::Rest).count();
    let view = session.viewer.view;
    let (rows, samples) = at_rest(&session.held);
    assert_eq!((rests, rows), (1, view.height_px), "{:?}", made.iter().map(|made| made.reason).collect::<Vec<_>>());
    assert!(samples > 0 && samples <= (view.width_px * view.height_px) as usize);
    assert!(session.tick().is_none(), "at rest nothing is sent");

    let mut beside = start;
    beside.translation += start.rotation * (0.1 * DVec3::X);
    session.hear(beside, DVec3::X);
    session.tick().expect("who moves gets what comes into view");
    assert_eq!(at_rest(&session.held), (0, 0));
    session.hear(beside, DVec3::ZERO);
    all(&mut session);
    assert_eq!(at_rest(&session.held).0, view.height_px, "and the next view");
}

#[test]
fn a_slow_path_gets_rows_by_and_by_and_every_row_once() {
    let mut session = Session::resting("urban");
    session.viewer.view = ViewSize { width_px: 640, height_px: 360, ..session.viewer.view };
    let start = session.viewer.world_from_eye;
    session.hear(start, DVec3::ZERO);
    session.tick().expect("a first set");
    session.viewer.bytes_per_s = Some(30e3);
    let mut rows = Vec::new();
    for _ in 0..TICKS {
        if session.tick().is_some_and(|made| made.reason == Reason::Rest) {
            rows.push(at_rest(&session.held).0);
        }
    }
    assert!(rows.len() > 2 && rows.is_sorted(), "{rows:?}");
    assert_eq!(rows.last(), Some(&session.viewer.view.height_px));
}

#[test]
fn a_copy_that_began_anew_gets_its_view_anew() {
    let mut session = Session::resting("urban");
    all(&mut session);
    session.start_anew();
    all(&mut session);
    assert_eq!(at_rest(&session.held).0, session.viewer.view.height_px);
}

#[test]
fn a_scene_that_moves_has_no_view_at_rest() {
    let mut session = Session::resting("urban-moving");
    session.ticks(6);
    assert_eq!(at_rest(&session.held), (0, 0));
}
