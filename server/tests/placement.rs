//! Sets whose views probes choose.

mod common;

use common::session::Session;
use common::*;
use glam::{DAffine3, DVec3};
use vantage_server::discretize::placement::Placement;

/// The images of a first set of a scene, seen from the origin.
fn first_set(scene: scene::Scene, placement: Placement) -> usize {
    let mut session = Session::new(scene);
    session.stage = session.stage.placed(placement);
    session.tick().expect("a first set");
    session.held.patches.len()
}

fn wall_place() -> DAffine3 {
    DAffine3::from_translation(DVec3::new(0.0, 0.0, -3.0)) * DAffine3::from_scale(DVec3::splat(8.0))
}

fn squares(places: impl Iterator<Item = DAffine3>) -> scene::Scene {
    let placed: Vec<_> = places.map(|place| (0, place)).collect();
    scene(vec![square(4, 0)], vec![coloured([0.5; 4])], &placed)
}

fn wall() -> scene::Scene {
    squares(std::iter::once(wall_place()))
}

/// The wall behind a row of posts.
fn fence() -> scene::Scene {
    let post = |x: i32| {
        let place = DAffine3::from_translation(DVec3::new(f64::from(x) * 0.25, 0.0, -1.0));
        place * DAffine3::from_scale(DVec3::new(0.02, 2.0, 1.0))
    };
    squares((-6..=6).map(post).chain([wall_place()]))
}

#[test]
fn a_scene_that_one_image_covers_gets_one() {
    assert!(first_set(wall(), Placement::Fixed) > 1);
    assert_eq!(first_set(wall(), Placement::Probes), 1);
}

#[test]
fn a_scene_that_hides_something_gets_more() {
    assert!(first_set(fence(), Placement::Probes) > 1);
}
