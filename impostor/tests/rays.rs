//! Rays that no effect should make, or that lie just so: each search ends, and says what is there.

mod support;

use camera::{Camera, ImagePoint, Pinhole, Rigid, Spoc};
use glam::DVec3;
use proptest::prelude::*;
use support::{Image, scenes};
use vantage_impostor::{Impostor, ImpostorError, Method, Ray, Sample, Search, Side, Steps};

const METHODS: [Method; 4] = [Method::Points, Method::Fine, Method::Coarse { coarse_px: 6.0 }, Method::Hierarchy];

/// A curve is cut into at most 65,536 steps, and halved into as many stretches and their parents.
const MOST_STEPS: u32 = 3 << 16;

fn search(image: &Image, ray: Ray) -> [Search; 4] {
    METHODS.map(|method| {
        let search = image.impostor.hit(&ray, Steps { method, fine_px: 0.25 });
        assert!(search.count.steps() <= MOST_STEPS * search.count.curves.max(1), "{ray:?}: {:?}", search.count);
        if let Some(hit) = search.hit {
            assert!(hit.t >= ray.t_from && hit.t <= ray.t_to && hit.p_world.is_finite(), "{ray:?}: {hit:?}");
        }
        search
    })
}

fn number() -> impl Strategy<Value = f64> {
    let odd = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 1e-308, 1e150, 1.0, -4.0];
    prop_oneof![prop::sample::select(odd.to_vec()), -5.0..5.0_f64]
}

fn vector() -> impl Strategy<Value = DVec3> {
    (number(), number(), number()).prop_map(DVec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_search_ends(
        image in 0_usize..4,
        origin_world in vector(),
        direction_world in vector(),
        t_from in number(),
        t_to in number(),
    ) {
        search(&scenes::IMAGES[image], Ray { origin_world, direction_world, t_from, t_to });
    }

    #[test]
    fn steps_and_stretches_of_any_length_end(
        image in 0_usize..4,
        fine_px in number(),
        coarse_px in number(),
        way in vector(),
    ) {
        for method in [Method::Points, Method::Fine, Method::Coarse { coarse_px }, Method::Hierarchy] {
            let image = &scenes::IMAGES[image];
            let search = image.impostor.hit(&Ray::endless(DVec3::new(0.3, 1.0, 2.5), way), Steps { method, fine_px });
            prop_assert!(search.count.steps() <= MOST_STEPS * search.count.curves.max(1));
        }
    }
}

/// The eye of the pot's cameras, and the way that their axis goes.
fn eye_and_axis() -> (DVec3, DVec3) {
    let eye = scenes::POT_EYE;
    (eye, (scenes::POT_BOUNDS.middle() - eye).normalize())
}

#[test]
fn a_ray_through_the_eye_and_the_pole_is_one_point_and_hits() {
    let (eye, axis) = eye_and_axis();
    for image in &scenes::IMAGES[..2] {
        for ray in [Ray::endless(eye, axis), Ray::endless(eye - axis * 7.0, axis)] {
            let truth = image.scene.points(ray.origin_world, ray.direction_world, 0.0, 1e3)[0];
            for Search { hit, count } in search(image, ray) {
                let hit = hit.expect("the pot");
                assert!(hit.p_world.distance(truth.p_world) < 0.01 && hit.side == Side::Front, "{hit:?}, {truth:?}");
                assert!(count.steps() <= 2, "{count:?}");
            }
        }
    }
}

#[test]
fn a_ray_from_behind_comes_out_of_the_back_of_what_is_shown() {
    let (eye, axis) = eye_and_axis();
    for image in &scenes::IMAGES[..2] {
        for Search { hit, .. } in search(image, Ray::segment(eye + axis * 8.0, eye)) {
            assert_eq!(hit.map(|hit| hit.side), Some(Side::Back));
        }
    }
}

#[test]
fn rays_behind_the_camera_without_length_or_missing_numbers_meet_nothing() {
    let (eye, axis) = eye_and_axis();
    for image in &scenes::IMAGES[..2] {
        for ray in [
            Ray::endless(eye, -axis),
            Ray::endless(eye - axis, axis.any_orthogonal_vector()),
            Ray::endless(DVec3::ZERO, DVec3::ZERO),
            Ray::endless(eye, DVec3::NAN),
            Ray::endless(DVec3::INFINITY, axis),
            Ray { t_from: 1.0, t_to: 0.0, ..Ray::endless(eye, axis) },
            Ray { t_from: f64::NAN, t_to: f64::NAN, ..Ray::endless(DVec3::Z, DVec3::X) },
            Ray::segment(eye, eye + axis * 0.5),
        ] {
            for Search { hit, .. } in search(image, ray) {
                assert_eq!(hit, None, "{ray:?}");
            }
        }
    }
}

#[test]
fn rays_along_the_axes_and_along_pixel_borders_hit_as_others_do() {
    let image = &scenes::IMAGES[0];
    let Camera::Pinhole(camera) = image.impostor.camera() else { panic!("the first is a pinhole's") };
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for sign in [1.0, -1.0] {
            search(image, Ray::endless(-axis * sign * 4.0, axis * sign));
        }
    }
    // Down the border of two columns, and through corners of pixels, before the pot and into it.
    let world = |u: f64, v: f64, z: f64| camera.world_from_image(ImagePoint { u, v, w: 1.0 / z });
    for ray in [
        Ray::segment(world(128.0, 20.0, 2.0), world(128.0, 128.0, 3.6)),
        Ray::segment(world(20.0, 20.0, 2.0), world(128.0, 128.0, 3.6)),
        Ray::segment(world(128.0, 200.0, 2.0), world(128.0, 128.0, 3.6)),
    ] {
        let truth = image.scene.points(ray.origin_world, ray.direction_world, 0.0, 1.0)[0];
        for Search { hit, .. } in search(image, ray) {
            assert!(hit.expect("the pot").p_world.distance(truth.p_world) < 0.02, "{hit:?} {truth:?}");
        }
    }
}

/// A metre behind the plate and a metre before the wall, so that it crosses both outlines of the plate.
#[test]
fn a_ray_that_passes_between_two_surfaces_clear_of_both_meets_nothing() {
    let image = scenes::plate_by_pinhole(64);
    for angle in 0..64 {
        let (sin, cos) = (f64::from(angle) * 0.1).sin_cos();
        let way = DVec3::new(cos, sin, 0.0);
        for Search { hit, .. } in search(&image, Ray::segment(DVec3::NEG_Z - way * 1.9, DVec3::NEG_Z + way * 1.9)) {
            assert_eq!(hit, None);
        }
        // And it meets the wall, if it goes there, beside the plate.
        let into = Ray::segment(DVec3::NEG_Z - way * 2.5, DVec3::new(0.0, 0.0, -2.5) - way * 3.5);
        for Search { hit, .. } in search(&image, into) {
            let hit = hit.expect("the wall");
            assert!((hit.p_world.z + 2.0).abs() < 1e-9 && hit.side == Side::Front, "{hit:?}");
        }
    }
}

/// A push of many images over a thousandth of a pixel is beyond what steps follow, but they end.
#[test]
fn a_push_without_measure_ends() {
    let Camera::Spoc(camera) = scenes::IMAGES[1].impostor.camera() else { panic!("the second is a pole's") };
    let camera = Spoc { push_max_px: 1e5, ramp_px: 1e-3, ..*camera };
    let image = Image::take(
        Camera::Spoc(Spoc { pinhole: Pinhole { width_px: 64, height_px: 64, ..camera.pinhole }, ..camera }),
        scenes::pot(),
    );
    let (eye, axis) = eye_and_axis();
    let across = axis.any_orthonormal_vector();
    search(&image, Ray::segment(eye + axis * 4.0 - across, eye + axis * 4.1 + across));
}

#[test]
fn samples_that_are_missing_or_no_numbers_are_empty() {
    let camera = Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (3, 1), 1.0, 0.1));
    let sample = |w: f64| Sample { w, normal_world: DVec3::Z };
    let refused = Impostor::new(camera.clone(), &[sample(1.0)]).map(|_| ());
    assert_eq!(refused, Err(ImpostorError::Size { samples: 1, width_px: 3, height_px: 1 }));
    let unknown = Sample { w: 0.5, normal_world: DVec3::NAN };
    for samples in [[Sample::EMPTY; 3], [sample(f64::NAN), sample(-1.0), unknown], [sample(f64::INFINITY); 3]] {
        let impostor = Impostor::new(camera.clone(), &samples).expect("three samples");
        assert_eq!(impostor.bounds_world(), None);
        let search = impostor.hit(&Ray::endless(DVec3::ZERO, DVec3::Z), Steps { method: Method::Fine, fine_px: 1.0 });
        assert_eq!((search.hit, search.count.steps()), (None, 0));
    }
    // Without a normal a sample lies across.
    let across = Sample { w: 0.5, normal_world: DVec3::ZERO };
    let impostor = Impostor::new(camera, &[across; 3]).expect("three samples");
    let ray = Ray::endless(DVec3::ZERO, DVec3::Z);
    let hit = impostor.hit(&ray, Steps { method: Method::Hierarchy, fine_px: 1.0 }).hit;
    assert_eq!(hit.map(|hit| (hit.t, hit.pixel)), Some((2.0, (1, 0))));
}
