//! What is blended is sent in layers: once, beside everything else, and not where nothing is.

mod common;

use std::collections::BTreeSet;

use camera::Rigid;
use common::session::Session;
use glam::DVec3;
use protocol::{DepthImage, Held, Purpose};
use vantage_server::account::Counts;
use vantage_server::account::samples::Samples;

/// The objects that samples are held of, by what for.
fn objects(held: &Held, is_meant: impl Fn(Purpose) -> bool) -> BTreeSet<u16> {
    let meant = held.patches.values().filter(|held| is_meant(held.patch.purpose));
    meant.flat_map(|held| held.patch.image.object.iter().copied()).collect()
}

fn is_layer(purpose: Purpose) -> bool {
    matches!(purpose, Purpose::Layer(_))
}

#[test]
fn what_is_seen_through_is_in_layers_alone_and_what_lies_behind_is_held() {
    let mut session = Session::built_in("window");
    let looks: Vec<Counts> = session.settle();
    println!("{:?}", looks.iter().map(|look| look.added).collect::<Vec<_>>());
    assert!(looks.len() <= 14, "looks come to an end: {looks:?}");
    let scene = session.scene.clone();
    let blended: BTreeSet<u16> = (0..scene.instances.len() as u16)
        .filter(|&object| {
            scene.is_seen_through(scene.meshes[scene.instances[usize::from(object)].mesh as usize].material as usize)
        })
        .collect();
    assert_eq!(blended.len(), 4, "pane, stripe, bottle and stained pane");
    assert_eq!(objects(&session.held, is_layer), blended);
    let opaque = objects(&session.held, |purpose| purpose == Purpose::Eye);
    assert!(opaque.is_disjoint(&blended));
    // The balls are behind the pane.
    let names = opaque.iter().map(|&object| scene.instances[usize::from(object)].name.as_str());
    assert!(names.filter(|name| *name == "ball").count() >= 2);
    // The pane hides two fifths, wherever it is seen.
    let pane = scene.instances.iter().position(|instance| instance.name == "pane").expect("there is one") as u16;
    for held in session.held.patches.values().filter(|held| is_layer(held.patch.purpose)) {
        let DepthImage { object, share, .. } = &held.patch.image;
        let of_pane = object.iter().zip(share).filter(|(object, _)| **object == pane);
        assert!(of_pane.into_iter().all(|(_, share)| *share == (0.4 * f32::from(DepthImage::WHOLE)).round() as u8));
    }
    // Both walls of the bottle are seen: two layers hold it.
    let bottle = scene.instances.iter().position(|instance| instance.name == "bottle").expect("there is one") as u16;
    let of_bottle = |layer| objects(&session.held, |purpose| purpose == Purpose::Layer(layer)).contains(&bottle);
    assert_eq!((0..Purpose::LAYERS).filter(|&layer| of_bottle(layer)).count(), 2);
}

#[test]
fn an_eye_that_moves_is_sent_little_more_of_a_layer() {
    let mut session = Session::built_in("window");
    session.settle();
    let samples = |held: &Held| -> usize {
        let layers = held.patches.values().filter(|held| is_layer(held.patch.purpose));
        layers.map(|held| held.patch.image.sample_count()).sum()
    };
    let before = samples(&session.held);
    let eye = session.viewer.world_from_eye;
    session.hear(Rigid { translation: eye.translation + DVec3::X * 0.05, ..eye }, DVec3::ZERO);
    session.settle();
    let after = samples(&session.held);
    println!("{before} samples of layers, then {after}");
    assert!(after > 0 && after < before + before / 2, "{before} samples of layers, then {after}");
}

#[test]
fn a_scene_without_anything_blended_has_no_layers() {
    let mut session = Session::built_in("teapots");
    session.settle();
    assert!(objects(&session.held, is_layer).is_empty());
}

#[test]
fn what_a_view_sent_of_a_layer_counts_for_that_layer_alone() {
    let mut session = Session::built_in("window");
    session.settle();
    let account = &session.client.account;
    let mut triangles = 0;
    for held in account.held().patches.values().filter(|held| is_layer(held.patch.purpose)) {
        let camera = held.patch.image.camera.pinhole().expect("a pinhole");
        let of_eye: BTreeSet<u32> = account.sent_by(camera, Purpose::Eye).into_iter().collect();
        let of_layer = account.sent_by(camera, held.patch.purpose);
        triangles += of_layer.iter().filter(|&&triangle| triangle != 0).count();
        assert!(of_layer.iter().all(|triangle| *triangle == 0 || !of_eye.contains(triangle)));
    }
    assert!(triangles > 100, "{triangles}");
}
