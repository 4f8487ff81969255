//! A viewer who stands still in a scene that stands still: looks come to an end by themselves, in every built-in scene.

mod common;

use std::sync::Arc;

use protocol::message::ViewSize;
use vantage_server::Config;
use vantage_server::account::BYTES_PER_SAMPLE;
use vantage_server::discretize::Discretization;
use vantage_server::frame::{Client, Stage};
use vantage_server::imager::GpuImager;
use vantage_server::plan::Rules;
use vantage_server::viewer::Viewer;

const VIEW: ViewSize = ViewSize { width_px: 96, height_px: 96, fov_y_rad: 1.0 };
/// The first set, what four views lack of it, and four trims of each layer of leaves that the trims before laid bare.
const MOST_LOOKS: usize = 14;

/// Samples added, deleted and trimmed at each look of a viewer who stands where viewers begin, and those held in the end.
fn looks(name: &str, budget_bytes: u64) -> (Vec<[usize; 3]>, usize) {
    let gpu = common::gpu();
    let scene = Arc::new(scene::builtin::load(name).expect("a built-in scene"));
    let rules = Rules {
        images: 4,
        image_size_px: 96,
        update_interval_s: 0.1,
        near_m: vantage_server::start::near_m(&scene),
        margin_m: Rules::margin_m(scene.walk, scene.bounds.radius_m()),
        animated: false,
    };
    let imager = Box::new(GpuImager::new(&gpu, &scene, &Config::default()).expect("the scene uploads"));
    let viewer = Viewer::at_start(VIEW, vantage_server::start::start_pose(&scene), 0.0);
    let mut stage = Stage::new(scene, rules, Discretization::NonRedundant, imager);
    let (mut client, mut looks) = (Client { budget_bytes, ..Client::default() }, Vec::new());
    while client.focus.is_none_or(|focus| !focus.settled) {
        let made = stage.update(&viewer, &mut client, 0.0).expect("a look");
        looks.push(made.map_or([0; 3], |made| [made.counts.added, made.counts.deleted, made.counts.trimmed]));
        assert!(looks.len() <= MOST_LOOKS, "{name}, {budget_bytes} bytes: added, deleted and trimmed {looks:?}");
    }
    (looks, client.account.held().sample_count())
}

#[test]
fn looks_at_every_built_in_scene_come_to_an_end() {
    for name in ["teapots", "birdnest", "grass", "urban", "tree", "maze", "barrels", "cars", "pillars"] {
        let (looks, held) = looks(name, u64::MAX);
        eprintln!("{name}: {held} held; added, deleted and trimmed a look: {looks:?}");
        let later: usize = looks[1..].iter().map(|[added, ..]| added).sum();
        assert!(later < looks[0][0] / 10, "{name}: {later} samples after the first {}", looks[0][0]);
    }
}

#[test]
fn looks_end_whatever_the_budget() {
    let (_, whole) = looks("urban", u64::MAX);
    for percent in [0, 5, 30, 60, 95] {
        let budget = whole as u64 * BYTES_PER_SAMPLE * percent / 100;
        let (looks, held) = looks("urban", budget);
        eprintln!("{percent} % of {whole}: {held} held after {} looks", looks.len());
    }
}
