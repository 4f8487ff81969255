//! Two imagers of one scene, each at a time and place of its own, see what either would alone.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

mod common;

use std::collections::BTreeSet;

use camera::Pinhole;
use glam::DVec3;
use scene::Scene;
use vantage_server::Config;
use vantage_server::discretize::{Capture, Discretization};
use vantage_server::imager::{GpuImager, Imager};
use vantage_server::render::LeftOut;
use vantage_server::start::{near_m, start_pose};

/// What an imager sees of a scene, looking again and again while time goes on from `begin_s`.
fn seen(
    imager: &mut dyn Imager,
    scene: &Scene,
    (begin_s, aside_m): (f64, f64),
    left_out: &BTreeSet<u16>,
) -> Vec<Capture> {
    let mut eye = start_pose(scene);
    eye.translation += DVec3::X * aside_m;
    imager.leave_out(LeftOut { absent: left_out.clone(), ..LeftOut::default() });
    let look = |step: u32| {
        let snapshot = scene.at(begin_s + f64::from(step) * 0.3);
        let view = Pinhole::symmetric(eye, (48, 40), 1.2, near_m(scene));
        let mut captures = imager.captures(&snapshot, &[view; 2], Discretization::default()).unwrap();
        for capture in &mut captures {
            let mask = vantage_server::account::findings::Lacking::all(capture).send;
            imager.tell_ends(capture, &mask).unwrap();
        }
        captures
    };
    (0..3).flat_map(look).collect()
}

#[test]
fn twins_do_not_disturb_each_other() {
    let gpu = common::gpu();
    let scene = scene::builtin::load("pillars-moving").unwrap();
    let imager = || GpuImager::new(&gpu, &scene, &Config::default()).unwrap();
    let (places, left_out) = ([(0.0, 0.0), (7.0, 1.5)], [BTreeSet::new(), BTreeSet::from([3, 9, 20])]);
    let alone: Vec<_> = (0..2).map(|who| seen(&mut imager(), &scene, places[who], &left_out[who])).collect();
    let mut first = imager();
    let mut second = first.twin().expect("nothing deforms");
    let together = std::thread::scope(|scope| {
        let second = scope.spawn(|| seen(&mut *second, &scene, places[1], &left_out[1]));
        [seen(&mut first, &scene, places[0], &left_out[0]), second.join().unwrap()]
    });
    assert_ne!(alone[0][0].ids, alone[1][0].ids, "they see different things");
    for (alone, together) in alone.iter().zip(&together) {
        for (alone, together) in alone.iter().zip(together) {
            assert!(alone.ids == together.ids && alone.depth == together.depth && alone.ends == together.ends);
            assert!(alone.colour == together.colour);
        }
    }
}
