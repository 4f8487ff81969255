//! A viewer who stands still in a scene that stands still: looks come to an end by themselves, in every built-in scene.

mod common;

use common::session::Session;
use vantage_server::account::BYTES_PER_SAMPLE;

/// The first set, what its views lack of it, and four trims of each layer of leaves that the trims before laid bare.
const MOST_LOOKS: usize = 14;

/// What looks of a viewer who stands where viewers begin did, and the samples held in the end.
fn settle(name: &str, budget_bytes: u64) -> (Vec<usize>, usize) {
    let mut session = Session::built_in(name);
    session.client.budget_bytes = budget_bytes;
    let looks = session.settle();
    assert!(looks.len() <= MOST_LOOKS, "{name}, {budget_bytes} bytes: {looks:?}");
    (looks.iter().map(|look| look.added).collect(), session.held.sample_count())
}

#[test]
fn looks_at_every_built_in_scene_come_to_an_end() {
    for name in ["teapots", "birdnest", "grass", "urban", "tree", "maze", "barrels", "cars", "pillars"] {
        let (sent, held) = settle(name, u64::MAX);
        println!("{name}: {held} held, sent {sent:?}");
        let later: usize = sent[1..].iter().sum();
        // 0.135 was measured on the nest, whose twigs are thinner than these pixels; 0.002 to 0.06 elsewhere.
        assert!(later < sent[0] / 5, "{name}: {later} samples after the first {}", sent[0]);
    }
}

#[test]
fn looks_end_whatever_the_budget() {
    for name in ["urban", "birdnest"] {
        let (_, whole) = settle(name, u64::MAX);
        for percent in [0, 5, 30, 60, 95] {
            let (sent, held) = settle(name, whole as u64 * BYTES_PER_SAMPLE * percent / 100);
            println!("{name}, {percent} % of {whole}: {held} held, sent {sent:?}");
        }
    }
}
