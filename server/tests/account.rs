//! What a client holds counts as sampled: the account on the software adapter, with scenes whose needs are known.

mod common;

use common::session::{Session, added};
use common::{ball_before_wall, moving_ball, swing};
use glam::DVec3;
use vantage_server::account::Counts;
use vantage_server::plan::Reason;

#[test]
fn edits_for_a_still_viewer_come_to_an_end() {
    let mut session = Session::new(ball_before_wall());
    let first = session.tick().expect("a first update");
    assert_eq!(first.reason, Reason::First);
    let rest = session.settle();
    assert!(added(&rest) < first.counts.added / 10, "{} and then {rest:?}", first.counts.added);
    assert!(rest.len() < 6, "looks are bounded, but these end by themselves: {rest:?}");
    assert!((0..5).all(|_| session.tick().is_none()), "nothing lacks any more");
}

#[test]
fn a_step_aside_costs_what_it_uncovers_and_the_way_back_next_to_nothing() {
    let mut session = Session::new(ball_before_wall());
    session.settle();
    let whole = session.held.sample_count();
    session.stand_at(DVec3::new(0.6, 0.0, 0.0));
    let aside = added(&session.settle());
    assert!(aside > 0 && aside < whole / 3, "{aside} of {whole}");
    session.stand_at(DVec3::ZERO);
    let back = added(&session.settle());
    // At most the strip beside the view that the rim whose turn it is looks past.
    assert!(back * 10 < whole, "{back} back after {aside} aside, of {whole}");
}

#[test]
fn a_step_closer_replaces_what_is_too_coarse() {
    let mut session = Session::new(ball_before_wall());
    session.settle();
    let before = session.held.sample_count();
    session.stand_at(DVec3::new(0.0, 1.5, -3.0));
    let counts = session.settle();
    let deleted: usize = counts.iter().map(|counts| counts.deleted).sum();
    assert!(added(&counts) > 1000 && deleted > 100, "{counts:?}");
    assert!(session.held.sample_count() < before + added(&counts), "what was replaced is gone");
}

#[test]
fn a_moving_rigid_object_carries_its_samples() {
    let mut session = Session::new(moving_ball(|time_s| swing(time_s, 25.0)));
    let first = session.tick().expect("a first update").counts.added;
    let rest: Vec<Counts> = (0..20).filter_map(|_| session.tick()).map(|made| made.counts).collect();
    assert_eq!(rest.len(), 20, "time goes on, and clients are told");
    let (added, anew) = (added(&rest), rest.iter().map(|counts| counts.anew).sum::<usize>());
    assert!(added > 0 && added < anew / 20, "{added} of {anew} for what it uncovers, {first} at first");
}

#[test]
fn a_budget_evicts_what_was_least_recently_seen_and_no_more() {
    let mut session = Session::new(ball_before_wall());
    session.settle();
    let budget = session.held.sample_count() * 21 / 20;
    session.client.budget_bytes = budget as u64 * vantage_server::account::BYTES_PER_SAMPLE;
    let mut evicted = 0;
    for step in 1..8 {
        session.stand_at(DVec3::new(f64::from(step), 0.0, 0.0));
        evicted += session.settle().iter().map(|counts| counts.evicted).sum::<usize>();
        assert!(session.held.sample_count() <= budget, "{} held of {budget}", session.held.sample_count());
    }
    session.stand_at(DVec3::ZERO);
    let back = added(&session.settle());
    assert!(evicted > 0 && back > 0, "{evicted} evicted, {back} sent again on the way back");
}

#[test]
fn a_budget_of_almost_nothing_gives_coarse_views_that_settle() {
    let mut session = Session::new(ball_before_wall());
    session.client.budget_bytes = 0;
    session.settle();
    let held = session.held.sample_count();
    assert!(held > 100 && held < 3 * 16 * 16 * 2, "{held} samples of three views of 16 x 16");
}

#[test]
fn a_broken_copy_begins_anew() {
    let mut session = Session::new(ball_before_wall());
    session.settle();
    session.start_anew();
    let first = session.tick().expect("a first update");
    assert!(matches!(first.update.edits.first(), Some(protocol::Edit::Clear)));
    assert_eq!(first.reason, Reason::First);
    session.settle();
}
