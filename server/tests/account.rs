//! What a client holds counts as sampled: the account on the software adapter, with scenes whose needs are known.

mod common;

use std::sync::Arc;

use camera::Rigid;
use glam::{DAffine3, DVec3};
use protocol::message::ViewSize;
use protocol::{Held, Update};
use scene::model::Animation;
use scene::{Scene, Snapshot};
use vantage_server::Config;
use vantage_server::account::Counts;
use vantage_server::discretize::Discretization;
use vantage_server::frame::{Client, Made, Stage};
use vantage_server::imager::GpuImager;
use vantage_server::plan::{Reason, Rules};
use vantage_server::viewer::Viewer;

const VIEW: ViewSize = ViewSize { width_px: 96, height_px: 96, fov_y_rad: 1.2 };
const INTERVAL_S: f64 = 0.1;

/// A wall with a ball before it, seen from 4 m in front of the wall.
fn ball_before_wall() -> Scene {
    let at = |z: f64, scale: f64| {
        DAffine3::from_scale_rotation_translation(DVec3::splat(scale), glam::DQuat::IDENTITY, DVec3::new(0.0, 0.0, z))
    };
    common::scene(
        vec![common::square(4, 0), common::sphere(24, 0)],
        vec![common::coloured([0.6, 0.5, 0.4, 1.0])],
        &[(0, at(-4.0, 8.0)), (1, at(-2.5, 0.4))],
    )
}

/// One client of a scene, with a copy of its own that must agree after every update.
struct Session {
    stage: Stage,
    client: Client,
    viewer: Viewer,
    held: Held,
    now_s: f64,
    seq: u64,
}

impl Session {
    fn new(scene: Scene) -> Session {
        let gpu = common::gpu();
        let scene = Arc::new(scene);
        let rules = Rules {
            images: 3,
            image_size_px: 96,
            update_interval_s: INTERVAL_S,
            near_m: 0.1,
            margin_m: 0.25,
            animated: scene.is_animated(),
        };
        let imager = Box::new(GpuImager::new(&gpu, &scene, &Config::default()).expect("the scene uploads"));
        let start = Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z);
        Session {
            stage: Stage::new(scene, rules, Discretization::NonRedundant, imager),
            client: Client::default(),
            viewer: Viewer::at_start(VIEW, start, 0.0),
            held: Held::default(),
            now_s: 0.0,
            seq: 0,
        }
    }

    fn tick(&mut self) -> Option<Made> {
        let made = self.stage.update(&self.viewer, &mut self.client, self.now_s).expect("an update");
        self.now_s += INTERVAL_S;
        if let Some(Made { update, .. }) = &made {
            self.take(update);
        }
        made
    }

    fn take(&mut self, update: &Update) {
        self.held.apply(update).expect("the digest agrees");
        assert_eq!(self.held.digest(), self.client.account.held().digest());
        assert_eq!(self.held.sample_count(), self.client.account.held().sample_count());
    }

    fn stand_at(&mut self, eye: DVec3) {
        self.seq += 1;
        let pose = Rigid::look_along(eye, DVec3::NEG_Z);
        self.viewer.hear(self.seq, self.now_s, pose, DVec3::ZERO, self.now_s);
    }

    /// Ticks until nothing lacks; what was done.
    fn settle(&mut self) -> Vec<Counts> {
        let mut all = Vec::new();
        for _ in 0..20 {
            match self.tick() {
                Some(made) => all.push(made.counts),
                None if self.client.focus.is_some_and(|focus| focus.settled) => return all,
                None => {}
            }
        }
        panic!("the viewer stands still, but edits go on: {all:?}");
    }
}

fn added(counts: &[Counts]) -> usize {
    counts.iter().map(|counts| counts.added).sum()
}

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
    assert!(back < aside / 4, "{back} back after {aside} aside");
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

/// The ball goes round, a metre in four seconds.
struct Round;

impl Animation for Round {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let still = ball_before_wall().at(0.0);
        let mut world_from_mesh = still.world_from_mesh;
        world_from_mesh[1].translation.x += (time_s * 0.25).sin();
        assert_eq!(world_from_mesh.len(), scene.instances.len());
        Snapshot { time_s, world_from_mesh, ..still }
    }
}

#[test]
fn a_moving_rigid_object_carries_its_samples() {
    let mut scene = ball_before_wall();
    scene.instances[1].moves = true;
    scene.animation = Arc::new(Round);
    let mut session = Session::new(scene);
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
    session.client.start_anew();
    session.held = Held::default();
    let first = session.tick().expect("a first update");
    assert!(matches!(first.update.edits.first(), Some(protocol::Edit::Clear)));
    assert_eq!(first.reason, Reason::First);
    session.settle();
}
