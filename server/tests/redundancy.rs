//! Sets of images by every redundancy test: what the GPU decides, against its meter and against the twin on the CPU.

mod common;

use camera::Pinhole;
use common::*;
use glam::{DAffine3, DVec3};
use gpu::Gpu;
use vantage_server::discretize::redundancy::redundant_samples;
use vantage_server::discretize::{Capture, Discretization, Meter, Redundancy, RedundancyTest};
use vantage_server::render::SceneRenderer;

/// Spheres before a wall, seen from four eyes by images of different sizes.
fn crowd(sphere_detail: u32) -> (scene::Scene, Vec<Pinhole>) {
    let place = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    let mut placed: Vec<_> = (0..9)
        .map(|index| (1, place(f64::from(index % 3) * 2.3 - 2.3, f64::from(index / 3) * 2.3 - 2.3, 0.0)))
        .collect();
    placed.push((0, place(0.0, 0.0, -3.0) * DAffine3::from_scale(DVec3::splat(12.0))));
    let scene = scene(vec![square(8, 0), sphere(sphere_detail, 1)], vec![coloured([0.5; 4])], &placed);
    let mut scene = scene;
    scene.meshes[1].material = 0;
    let eyes = [(0.0, 0.0, 128), (0.9, 0.1, 96), (-0.8, -0.4, 128), (0.1, 0.9, 80)];
    let cameras = eyes.iter().map(|&(x, y, size)| looking_back(DVec3::new(x, y, 4.5), size)).collect();
    (scene, cameras)
}

/// The crowd on a GPU, ready for rays.
struct Crowd {
    gpu: Gpu,
    renderer: SceneRenderer,
    cameras: Vec<Pinhole>,
}

impl Crowd {
    fn new() -> Crowd {
        Crowd::of(6)
    }

    fn of(sphere_detail: u32) -> Crowd {
        let gpu = gpu();
        let (scene, cameras) = crowd(sphere_detail);
        let mut renderer = renderer(&gpu, &scene, &cameras[0]).with_rays(&scene);
        renderer.update(&scene.at(0.0), cameras[0].world_from_eye.translation).expect("same scene");
        Crowd { gpu, renderer, cameras }
    }

    fn set(&self, method: Discretization) -> Vec<Capture> {
        captures(&self.renderer, &self.cameras, method)
    }

    fn by(&self, test: RedundancyTest) -> Vec<Capture> {
        self.set(Discretization::NonRedundant(Redundancy::by(test)))
    }

    /// Whether each sample is redundant: as the meter says, and as the twin says.
    fn redundant(&self, capture: &Capture, images: &[Capture], redundancy: Redundancy) -> [Vec<bool>; 2] {
        let meter = Meter::new(&self.gpu, redundancy).expect("a pipeline");
        let all = meter.redundant(&self.renderer, capture, &meter.images(images)).expect("measured");
        let occupied = all.iter().zip(&capture.ids).filter(|(_, ids)| ids[0] != 0);
        let (anchor, rays) = (self.renderer.anchor_world(), self.renderer.rays());
        let twin = redundant_samples(capture, images, redundancy, anchor, rays);
        [occupied.map(|(redundant, _)| *redundant).collect(), twin]
    }
}

fn samples(capture: &Capture) -> usize {
    capture.ids.iter().filter(|ids| ids[0] != 0).count()
}

fn total(set: &[Capture]) -> usize {
    set.iter().skip(1).map(samples).sum()
}

fn count(flags: &[bool]) -> usize {
    flags.iter().filter(|flag| **flag).count()
}

/// Every test, and one that minds the density.
fn redundancies() -> Vec<Redundancy> {
    let footprint = Discretization::FOOTPRINT.redundancy().expect("it leaves samples out");
    RedundancyTest::ALL.map(Redundancy::by).into_iter().chain([footprint]).collect()
}

#[test]
fn no_sample_is_redundant_by_its_own_test() {
    let crowd = Crowd::new();
    for redundancy in redundancies() {
        let set = crowd.set(Discretization::NonRedundant(redundancy));
        for index in 1..set.len() {
            let [meter, twin] = crowd.redundant(&set[index], &set[..index], redundancy);
            assert!(!meter.is_empty(), "image {index} holds nothing: the scene has occlusion");
            assert_eq!(count(&meter), 0, "of {} in image {index}, {redundancy:?}", meter.len());
            assert!(count(&twin) * 1000 <= twin.len(), "{} of {}, {redundancy:?}", count(&twin), twin.len());
        }
    }
}

#[test]
fn the_gpu_decides_as_the_cpu() {
    let crowd = Crowd::new();
    let all = crowd.set(Discretization::Conventional);
    for redundancy in redundancies() {
        for index in 1..all.len() {
            let [meter, twin] = crowd.redundant(&all[index], &all[..index], redundancy);
            let differ = meter.iter().zip(&twin).filter(|(meter, twin)| meter != twin).count();
            assert!(differ * 1000 <= twin.len(), "{differ} of {} in image {index}, {redundancy:?}", twin.len());
            let dropped = count(&twin);
            assert!(dropped * 2 > twin.len() && dropped < twin.len(), "{dropped} of {}, {redundancy:?}", twin.len());
        }
    }
}

#[test]
fn every_first_hit_of_a_view_is_held_by_the_set() {
    let crowd = Crowd::new();
    let all = crowd.set(Discretization::Conventional);
    let some = crowd.set(Discretization::PIXEL);
    assert_eq!(samples(&some[0]), samples(&all[0]), "the first image is conventional");
    for (view, held) in all.iter().zip(&some).skip(1) {
        assert!(samples(held) * 3 < samples(view) * 2, "{} of {}", samples(held), samples(view));
    }
    // What image 3 sees first is either in it or redundant with an earlier image of the set.
    let [redundant, _] = crowd.redundant(&all[3], &some[..3], Redundancy::by(RedundancyTest::Pixel));
    let occupied = (0..all[3].ids.len()).filter(|&index| all[3].ids[index][0] != 0);
    let missing =
        occupied.zip(&redundant).filter(|&(index, &redundant)| !redundant && some[3].ids[index] != all[3].ids[index]);
    assert!(missing.count() * 1000 <= redundant.len());
}

#[test]
fn the_tests_keep_more_or_fewer_samples() {
    let crowd = Crowd::new();
    let by = |test| total(&crowd.by(test));
    let pixel = by(RedundancyTest::Pixel);
    assert!(by(RedundancyTest::Neighbourhood) < pixel);
    // From the third image on the plain test takes again what an earlier image reached behind its dropped fragments.
    let (recursive, plain) = (by(RedundancyTest::Visibility), by(RedundancyTest::VisibilityPlain));
    assert!(recursive < plain, "{recursive} and {plain}");
    // By pixels, a line one pixel wide is kept along every edge between triangles.
    assert!(recursive < pixel && pixel < 2 * recursive, "{recursive} by rays, {pixel} by pixels");
    // Triangles of a tenth of a pixel: another triangle is at the pixel nearly everywhere, but of the same surface.
    let fine = Crowd::of(60);
    let (pixel, surface) = (total(&fine.by(RedundancyTest::Pixel)), total(&fine.by(RedundancyTest::Surface)));
    assert!(surface * 2 < pixel, "{surface} by surface, {pixel} by triangle");
}

#[test]
fn a_denser_sample_is_kept() {
    let gpu = gpu();
    let (scene, _) = crowd(6);
    let cameras = [9.0, 4.5, 4.4].map(|z| looking_back(DVec3::new(0.0, 0.0, z), 96));
    let renderer = renderer(&gpu, &scene, &cameras[0]);
    let all = captures(&renderer, &cameras, Discretization::Conventional);
    // Of what the cameras see first; behind it lie layers that were hidden so far.
    let first_hits = |method| {
        let set = captures(&renderer, &cameras, method);
        let kept = |(set, all): (&Capture, &Capture)| set.ids.iter().zip(&all.ids).filter(|(a, b)| a == b).count();
        set.iter().zip(&all).map(kept).collect::<Vec<_>>()
    };
    let by_surface = first_hits(Discretization::NonRedundant(Redundancy::by(RedundancyTest::Surface)));
    let footprint = first_hits(Discretization::FOOTPRINT);
    assert!(footprint[1] > 2 * by_surface[1], "from half as far away: {footprint:?} and {by_surface:?}");
    assert!(footprint[2] * 10 < footprint[1], "from nearly the same place: {footprint:?}");
}

#[test]
fn layers_are_peeled_one_behind_the_other() {
    let crowd = Crowd::new();
    let layers = crowd.set(Discretization::DepthPeeling);
    assert!(layers.iter().all(|layer| layer.camera == crowd.cameras[0]));
    let depths = |index: usize| layers.iter().map(move |layer| layer.depth[index]).take_while(|depth| *depth > 0.0);
    let mut seen = 0;
    for index in 0..layers[0].ids.len() {
        let depths: Vec<f32> = depths(index).collect();
        assert!(depths.is_sorted_by(|front, back| front >= back), "nearest first: {depths:?}");
        seen = seen.max(depths.len());
    }
    assert!(seen >= 2, "the wall behind a sphere is a layer");
}
