//! Every discretization on what strains it: eyes where none should be, broken triangles, far places, surfaces that coincide.
//! What must hold: nothing that is not a number; a later image holds no sample that its own test finds in an earlier one; and where
//! nothing hides anything, later images hold next to nothing, so that samples do not grow with every image.

mod common;

use camera::{Pinhole, Rigid};
use common::*;
use glam::{DAffine3, DVec3, Vec3};
use scene::Scene;
use vantage_server::discretize::redundancy::redundant_samples;
use vantage_server::discretize::{Capture, Discretization, Meter, RedundancyTest};
use vantage_server::render::SceneRenderer;

const SIZE_PX: u32 = 64;

fn eye(at: DVec3, towards: DVec3) -> Pinhole {
    Pinhole::symmetric(Rigid::look_along(at, towards), (SIZE_PX, SIZE_PX), 1.2, 0.01)
}

/// Three eyes a little apart.
fn eyes(at: DVec3, towards: DVec3) -> Vec<Pinhole> {
    [DVec3::ZERO, DVec3::X * 0.05, DVec3::Y * 0.05].map(|apart| eye(at + apart, towards)).to_vec()
}

fn moved(at: DVec3, scale: f64) -> DAffine3 {
    DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(scale))
}

fn grey() -> Vec<scene::Material> {
    vec![coloured([0.5; 4])]
}

/// Triangles without area, needles, and many in a pixel.
fn broken() -> Scene {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1e-7], [0.5, 0.5], [0.5, 0.5], [0.0, 1e-6], [0.9, 1.0]];
    let vertices = corners.map(|[x, y]| vertex(Vec3::new(x, y, 0.0), Vec3::Z, [0.0; 2])).to_vec();
    let needles = mesh(vertices, vec![0, 1, 2, 3, 4, 3, 0, 5, 6, 1, 1, 1, 0, 1, 6], 0);
    let behind = moved(DVec3::new(0.0, 0.0, -3.0), 4.0);
    let fine = moved(DVec3::new(0.0, 0.0, -2.9), 1.0);
    scene(
        vec![square(2, 0), square(256, 0), needles],
        grey(),
        &[(0, behind), (1, fine), (2, moved(DVec3::new(0.0, 0.0, -2.0), 1.0))],
    )
}

/// Two walls in one plane, and a third that is the first one again.
fn doubled(at: DVec3) -> Scene {
    let place = moved(at + DVec3::new(0.0, 0.0, -3.0), 4.0);
    scene(vec![square(3, 0), square(4, 0)], grey(), &[(0, place), (1, place), (0, place)])
}

/// Name, scene, eyes, and whether the others see much that is hidden from the first (from a vertex, only the third is outside).
fn cases() -> Vec<(&'static str, Scene, Vec<Pinhole>, bool)> {
    let wall = || scene(vec![square(4, 0)], grey(), &[(0, moved(DVec3::new(0.0, 0.0, -3.0), 8.0))]);
    let ball = || scene(vec![sphere(16, 0)], grey(), &[(0, moved(DVec3::ZERO, 1.0))]);
    let far = DVec3::new(1e7, -1e7, 1e7);
    vec![
        ("in the plane of a wall", wall(), eyes(DVec3::new(0.0, 0.0, -3.0), DVec3::X), false),
        ("on a surface", wall(), eyes(DVec3::new(0.0, 0.0, -3.0), DVec3::NEG_Z), false),
        ("grazing", wall(), eyes(DVec3::new(0.0, 0.0, -2.999), DVec3::new(1.0, 0.0, -1e-4)), false),
        ("inside an object", ball(), eyes(DVec3::ZERO, DVec3::NEG_Z), false),
        ("at a vertex", ball(), eyes(DVec3::Y, DVec3::NEG_Y), true),
        ("broken triangles", broken(), eyes(DVec3::ZERO, DVec3::NEG_Z), true),
        ("far away", doubled(far), eyes(far, DVec3::NEG_Z), true),
        ("doubled", doubled(DVec3::ZERO), eyes(DVec3::ZERO, DVec3::NEG_Z), true),
    ]
}

fn samples(capture: &Capture) -> usize {
    capture.ids.iter().filter(|ids| ids[0] != 0).count()
}

#[test]
fn every_method_keeps_its_word() {
    let gpu = gpu();
    for (what, scene, cameras, hides) in cases() {
        let renderer = SceneRenderer::new(&gpu, &scene).expect("the scene uploads");
        let mut renderer = renderer.with_rays(&scene);
        renderer.update(&scene.at(0.0), cameras[0].world_from_eye.translation).expect("same scene");
        for (name, method) in Discretization::NAMED {
            let set = captures(&renderer, &cameras, method);
            for (index, image) in set.iter().enumerate() {
                let sound = |(ids, depth): (&[u32; 2], &f32)| if ids[0] == 0 { *depth == 0.0 } else { *depth > 0.0 };
                assert!(image.ids.iter().zip(&image.depth).all(sound), "{what}, {name}: image {index}");
                assert!(image.depth.iter().all(|depth| depth.is_finite()), "{what}, {name}: image {index}");
            }
            let Some(redundancy) = method.redundancy() else { continue };
            let (anchor, rays) = (renderer.anchor_world(), renderer.rays());
            let meter = Meter::new(&gpu, redundancy).expect("a pipeline");
            for (index, image) in set.iter().enumerate().skip(1) {
                let found = meter.redundant(&renderer, image, &meter.images(&set[..index])).expect("measured");
                let found = found.into_iter().filter(|redundant| *redundant).count();
                assert_eq!(found, 0, "{what}, {name}: image {index} holds what an earlier one does");
                let twin = redundant_samples(image, &set[..index], redundancy, anchor, rays);
                let differ = twin.iter().filter(|redundant| **redundant).count();
                assert!(differ * 100 <= twin.len() + 100, "{what}, {name}: {differ} of {} differ", twin.len());
            }
            // What the second eye adds where nothing hides anything: a strip that the first did not see, and for tests that look at
            // one pixel, a line of pixels along every edge of triangles.
            let added = set[2..].iter().map(samples).max().unwrap_or(0);
            let is_bounded =
                hides || added * 3 <= (SIZE_PX * SIZE_PX) as usize || method == Discretization::DepthPeeling;
            assert!(is_bounded, "{what}, {name}: the third image still adds {added}");
        }
    }
}

#[test]
fn coincident_surfaces_are_taken_once_each() {
    let gpu = gpu();
    let scene = doubled(DVec3::ZERO);
    let cameras = vec![eye(DVec3::ZERO, DVec3::NEG_Z); 5];
    let renderer = renderer(&gpu, &scene, &cameras[0]);
    let by = |test| {
        let method = Discretization::NonRedundant(vantage_server::discretize::Redundancy::by(test));
        captures(&renderer, &cameras, method).iter().map(samples).collect::<Vec<_>>()
    };
    // Three triangles lie at every pixel, so three images at most are full, then none.
    let by_triangle = by(RedundancyTest::Pixel);
    assert!(by_triangle[1] > 0 && by_triangle[3..] == [0, 0], "{by_triangle:?}");
}
