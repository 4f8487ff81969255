//! Non-redundant images against the twin of the test on the CPU.

mod common;

use camera::Pinhole;
use common::*;
use glam::{DAffine3, DVec3};
use vantage_server::discretize::redundancy::redundant_samples;
use vantage_server::discretize::{Capture, Discretization, TexelTest};

/// Spheres before a wall, seen from four eyes by images of different sizes.
fn crowd() -> (scene::Scene, Vec<Pinhole>) {
    let place = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    let mut placed: Vec<_> = (0..9)
        .map(|index| (1, place(f64::from(index % 3) * 2.3 - 2.3, f64::from(index / 3) * 2.3 - 2.3, 0.0)))
        .collect();
    placed.push((0, place(0.0, 0.0, -3.0) * DAffine3::from_scale(DVec3::splat(12.0))));
    let scene = scene(vec![square(8, 0), sphere(6, 1)], vec![coloured([0.5; 4])], &placed);
    let mut scene = scene;
    scene.meshes[1].material = 0;
    let eyes = [(0.0, 0.0, 128), (0.9, 0.1, 96), (-0.8, -0.4, 128), (0.1, 0.9, 80)];
    let cameras = eyes.iter().map(|&(x, y, size)| looking_back(DVec3::new(x, y, 4.5), size)).collect();
    (scene, cameras)
}

fn sets(texel_test: TexelTest) -> (Vec<Capture>, Vec<Capture>) {
    let gpu = gpu();
    let (scene, cameras) = crowd();
    let renderer = renderer(&gpu, &scene, &cameras[0]);
    let all = captures(&renderer, &cameras, Discretization::Conventional, texel_test);
    let some = captures(&renderer, &cameras, Discretization::NonRedundant, texel_test);
    (all, some)
}

fn samples(capture: &Capture) -> usize {
    capture.ids.iter().filter(|ids| ids[0] != 0).count()
}

#[test]
fn no_sample_is_redundant_by_its_own_test() {
    for texel_test in [TexelTest::Single, TexelTest::Neighbourhood] {
        let (_, some) = sets(texel_test);
        for index in 1..some.len() {
            let redundant = redundant_samples(&some[index], &some[..index], texel_test);
            let count = redundant.iter().filter(|redundant| **redundant).count();
            assert!(!redundant.is_empty(), "image {index} holds nothing: the scene has occlusion");
            assert!(count * 1000 <= redundant.len(), "{count} of {} in image {index}, {texel_test:?}", redundant.len());
        }
    }
}

#[test]
fn the_gpu_decides_as_the_cpu() {
    let (all, some) = sets(TexelTest::Single);
    // Image 1 is tested against image 0, which is conventional: its first hits are dropped or kept as the twin says.
    let redundant = redundant_samples(&all[1], &all[..1], TexelTest::Single);
    let occupied: Vec<usize> = (0..all[1].ids.len()).filter(|&index| all[1].ids[index][0] != 0).collect();
    let agree = occupied
        .iter()
        .zip(&redundant)
        .filter(|&(&index, &redundant)| (some[1].ids[index] == all[1].ids[index]) != redundant)
        .count();
    assert!(agree * 1000 >= occupied.len() * 999, "{agree} of {}", occupied.len());
    let dropped = redundant.iter().filter(|redundant| **redundant).count();
    assert!(dropped * 2 > redundant.len() && dropped < redundant.len(), "{dropped} of {}", redundant.len());
}

#[test]
fn every_first_hit_of_a_view_is_held_by_the_set() {
    let (all, some) = sets(TexelTest::Single);
    assert_eq!(samples(&some[0]), samples(&all[0]), "the first image is conventional");
    for (view, held) in all.iter().zip(&some).skip(1) {
        assert!(samples(held) * 3 < samples(view) * 2, "{} of {}", samples(held), samples(view));
    }
    // What image 3 sees first is either in it or redundant with an earlier image of the set.
    let redundant = redundant_samples(&all[3], &some[..3], TexelTest::Single);
    let occupied = (0..all[3].ids.len()).filter(|&index| all[3].ids[index][0] != 0);
    let missing =
        occupied.zip(&redundant).filter(|&(index, &redundant)| !redundant && some[3].ids[index] != all[3].ids[index]);
    assert!(missing.count() * 1000 <= redundant.len());
}

#[test]
fn the_neighbourhood_test_keeps_fewer_samples() {
    let (_, single) = sets(TexelTest::Single);
    let (_, neighbourhood) = sets(TexelTest::Neighbourhood);
    let total = |set: &[Capture]| set.iter().skip(1).map(samples).sum::<usize>();
    assert!(total(&neighbourhood) < total(&single));
}
