//! Surfaces drawn on the GPU against scenes with a closed form.

mod common;

use std::collections::BTreeMap;

use camera::{Camera, Pinhole, Rigid};
use common::{Shape, Stage, ball, capture, held, truth, view};
use glam::{DAffine3, DQuat, DVec3};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Edit, Held, Mask, Material, ObjectPose, PatchId, Purpose};
use vantage_surface::{AddressPass, AddressTexel, CornerRules, Corners, HeldSurfaces, Smoothing, Tint};

const FLOOR: Shape = Shape::Plane { point: DVec3::ZERO, normal: DVec3::Y };
const WALL: Shape = Shape::Plane { point: DVec3::new(0.0, 0.0, -6.0), normal: DVec3::Z };

#[test]
fn a_plane_is_watertight_from_everywhere_and_stays_where_it_is() {
    let stage = Stage::new();
    let eye = DVec3::new(0.0, 1.7, 0.0);
    // From facing to grazing: the floor's far end is seen at 8 degrees.
    for (shapes, target) in [([WALL], DVec3::new(1.0, 1.0, -3.0)), ([FLOOR], DVec3::new(0.0, 0.0, -4.0))] {
        let patch = capture(&shapes, &view(eye, target, 96, 60.0));
        let mut surfaces = HeldSurfaces::new(&stage.gpu);
        surfaces.insert(&patch);
        for offset in ball(24) {
            let camera = view(eye + 0.2 * offset, target + 0.2 * offset, 64, 30.0);
            let drawn = stage.draw(&surfaces, &camera, Smoothing::Blended);
            assert_eq!(drawn.covered(), 64 * 64, "cracks in {shapes:?} from {offset}");
            for (pixel, hit) in truth(&shapes, &camera).iter().enumerate() {
                let expected = 1.0 / hit.unwrap().t as f32;
                assert!((drawn.w[pixel] - expected).abs() < 0.01 * expected, "{} for {expected}", drawn.w[pixel]);
                assert!(drawn.normal(pixel).dot(hit.unwrap().normal.as_vec3()) > 0.9998);
            }
        }
    }
}

#[test]
fn own_planes_crack_where_depth_is_coarse_and_averaged_corners_do_not() {
    let stage = Stage::new();
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(1.0, 1.0, -3.0), 96, 60.0);
    let mut patch = capture(&[WALL], &camera);
    let image = &mut patch.patch.image;
    let exact: Vec<f32> = image.depth.iter().map(|&code| image.depth_scale.w(code)).collect();
    image.depth_scale.w_step *= 64.0;
    image.depth = exact.iter().map(|&w| image.depth_scale.code(w)).collect();
    let uncovered = |corners| {
        let mut surfaces = HeldSurfaces::with_corners(&stage.gpu, corners, CornerRules::default());
        surfaces.insert(&patch);
        let output = view(DVec3::new(0.3, 1.9, 0.1), DVec3::new(1.0, 1.0, -3.0), 128, 30.0);
        128 * 128 - stage.draw(&surfaces, &output, Smoothing::None).covered()
    };
    assert_eq!(uncovered(Corners::Averaged), 0);
    assert!(uncovered(Corners::OwnPlane) > 20);
}

#[test]
fn every_quad_shows_its_own_sample_over_exactly_its_pixel() {
    let stage = Stage::new();
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.5, 0.8, -3.0), 48, 60.0);
    let patch = capture(&[WALL, FLOOR], &camera);
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&patch);
    let drawn = stage.draw(&surfaces, &camera, Smoothing::None);
    for (index, (x, y)) in patch.patch.image.mask.occupied().enumerate() {
        let pixel = (y * 48 + x) as usize;
        let [r, g, b] = patch.patch.image.colour[index];
        assert_eq!(drawn.colour[pixel], [r, g, b, 255], "at {x} {y}");
        assert_eq!(drawn.object(pixel), patch.patch.image.object[index]);
        assert_eq!(drawn.material(pixel), patch.patch.image.material[index]);
    }
}

fn single_sample(trim: u8, ends: Vec<u16>) -> HeldPatch {
    let camera = view(DVec3::ZERO, DVec3::NEG_Z, 8, 60.0);
    let mut mask = Mask::empty(8, 8);
    mask.set(3, 5, true);
    let image = DepthImage {
        camera: Camera::Pinhole(camera),
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0],
        normal: vec![octahedral_code(glam::Vec3::Z)],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends,
        colour: vec![[10, 20, 30]],
        object: vec![3],
        material: vec![4],
    };
    let mut patch = held(image);
    patch.trims = vec![trim];
    patch
}

#[test]
fn a_lone_sample_fills_its_pixel_unless_it_ends_or_is_trimmed() {
    let stage = Stage::new();
    // Of the 16 columns of its pixel, those whose centres lie within its share. Reaching 3.5 ninths to each side it is a square on its corner,
    // drawn as the upright one of the same area: 0.55 wide.
    let ending = 0x3333;
    for (trim, ends, side) in [(0, 0, 16), (1, 0, 8), (2, 0, 4), (3, 0, 2), (0, ending, 8), (1, ending, 4)] {
        let ends = if ends == 0 { Vec::new() } else { vec![ends] };
        let drawn = stage.draw_patch(&single_sample(trim, ends), &view(DVec3::ZERO, DVec3::NEG_Z, 128, 60.0));
        assert_eq!(drawn.covered(), side * side, "trim {trim}");
        let centre = (5 * 16 + 8) * 128 + 3 * 16 + 8;
        assert_eq!(drawn.colour[centre], [10, 20, 30, 255]);
        assert_eq!(drawn.w[centre], 0.5);
    }
}

#[test]
fn of_equally_fine_samples_those_show_that_were_taken_from_nearest() {
    let stage = Stage::new();
    let target = DVec3::new(0.0, 0.0, -6.0);
    // The same distance from the wall, so that all samples are equally fine.
    let eyes = [DVec3::X * -1.0, DVec3::X];
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    for (index, eye) in eyes.into_iter().enumerate() {
        let mut patch = capture(&[WALL], &view(eye, target + eye, 96, 60.0));
        patch.patch.id = PatchId(index as u32 + 1);
        patch.patch.image.colour.fill([index as u8 + 1; 3]);
        surfaces.insert(&patch);
    }
    for (index, eye) in eyes.into_iter().enumerate() {
        let drawn = stage.draw(&surfaces, &view(0.9 * eye, target, 64, 20.0), Smoothing::None);
        let of_nearest = drawn.colour.iter().filter(|colour| colour[0] == index as u8 + 1).count();
        assert!(of_nearest * 20 > drawn.colour.len() * 19, "{of_nearest} of {}", drawn.colour.len());
    }
}

#[test]
fn samples_show_how_old_they_are_or_how_dense() {
    let stage = Stage::tinted();
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.0, 1.7, -6.0), 32, 60.0);
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    let mut patch = capture(&[WALL], &camera);
    patch.patch.capture_time_s = 50.0;
    surfaces.insert(&patch);
    let shown = |surfaces: &HeldSurfaces, camera: &Pinhole| stage.draw(surfaces, camera, Smoothing::Blended).colour;
    // Now, a second, ten and a hundred later: yellow, red, violet, dark blue.
    let wanted = [[255, 230, 89], [230, 77, 51], [128, 38, 140], [20, 20, 89]];
    for (age_s, wanted) in [0.0, 1.0, 10.0, 100.0].into_iter().zip(wanted) {
        surfaces.set_tint(Tint::Age, 50.0 + age_s);
        for [r, g, b, a] in shown(&surfaces, &camera) {
            let off = [r, g, b].iter().zip(wanted).map(|(&found, wanted)| found.abs_diff(wanted)).max();
            assert!(off <= Some(2) && a == 255, "{:?} after {age_s} s", [r, g, b]);
        }
    }
    // One sample a pixel lies between red and violet; eight, and an eighth, at the ends.
    surfaces.set_tint(Tint::Density, 0.0);
    for (size, wanted) in [(32, [179, 57, 96]), (4, [255, 230, 89]), (256, [20, 20, 89])] {
        let from = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.0, 1.7, -6.0), size, 60.0);
        let [r, g, b, _] = shown(&surfaces, &from)[(size * size / 2 + size / 2) as usize];
        let off = [r, g, b].iter().zip(wanted).map(|(&found, wanted): (&u8, u8)| found.abs_diff(wanted)).max();
        assert!(off <= Some(3), "{:?} of {size} pixels", [r, g, b]);
    }
}

#[test]
fn a_sphere_grows_by_no_more_than_its_rim() {
    let stage = Stage::new();
    let sphere = [Shape::Sphere { centre: DVec3::new(0.0, 1.7, -4.0), radius: 1.0 }];
    let eye = DVec3::new(0.0, 1.7, 0.0);
    let target = DVec3::new(0.0, 1.7, -4.0);
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&capture(&sphere, &view(eye, target, 128, 45.0)));
    for offset in ball(16) {
        let camera = view(eye + 0.25 * offset, target, 128, 40.0);
        let (drawn, truth) = (stage.draw(&surfaces, &camera, Smoothing::None), truth(&sphere, &camera));
        let covered = truth.iter().flatten().count();
        let wrong = (0..truth.len()).filter(|&pixel| drawn.w[pixel] > 0.0 && truth[pixel].is_none()).count();
        let holes = (0..truth.len()).filter(|&pixel| drawn.w[pixel] == 0.0 && truth[pixel].is_some()).count();
        // The rim is about 4 sqrt(covered) pixels long: less than a pixel beyond it, and what the move uncovered at one side.
        assert!(wrong < 3 * covered.isqrt(), "{wrong} of {covered} pixels beside the sphere");
        assert!(holes < 3 * covered.isqrt(), "{holes} of {covered} pixels missing");
    }
}

#[test]
fn what_casts_lies_hardly_anywhere_before_a_surface_that_bends() {
    // As a light sees it, and in a map with eight times as fine texels: near its rim a sample is far longer than it is wide.
    let stage = Stage::casting();
    let sphere = [Shape::Sphere { centre: DVec3::new(0.0, 1.7, -4.0), radius: 1.0 }];
    let of_side = |side_px| view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.0, 1.7, -4.0), side_px, 45.0);
    let mut surfaces = HeldSurfaces::new(&stage.gpu).of(Purpose::Light(0));
    let mut patch = capture(&sphere, &of_side(48));
    patch.patch.purpose = Purpose::Light(0);
    surfaces.insert(&patch);
    let (drawn, truth) = (stage.draw(&surfaces, &of_side(384), Smoothing::None), truth(&sphere, &of_side(384)));
    let hits = truth.iter().zip(&drawn.w).filter_map(|(hit, w)| Some((1.0 / hit.as_ref()?.t, f64::from(*w))));
    let (mut covered, mut before) = (0, 0);
    for (surface_w, w) in hits.filter(|(_, w)| *w > 0.0) {
        covered += 1;
        before += usize::from(w > surface_w);
    }
    assert!(covered > 20_000 && before * 1000 < covered, "{before} of {covered} texels before the sphere");
}

#[test]
fn a_moved_object_is_drawn_where_it_is_now() {
    let stage = Stage::new();
    let at_capture = Shape::Sphere { centre: DVec3::new(0.0, 1.0, -4.0), radius: 1.0 };
    let moved_centre = DVec3::new(0.7, 1.3, -4.4);
    let moved = Shape::Sphere { centre: moved_centre, radius: 1.0 };
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.0, 1.0, -4.0), 128, 50.0);
    let pose = |x, y, z| DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.0), DVec3::new(x, y, z));
    let mut patch = capture(&[WALL, at_capture], &camera);
    patch.patch.objects = vec![ObjectPose { object: 2, world_from_object: pose(0.0, 1.0, -4.0) }];
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&patch);
    let still = stage.draw(&surfaces, &camera, Smoothing::None);
    surfaces.set_poses(&BTreeMap::from([(2, pose(0.7, 1.3, -4.4))]));
    let drawn = stage.draw(&surfaces, &camera, Smoothing::None);
    let expected = truth(&[WALL, moved], &camera);
    let mut compared = 0;
    for (pixel, hit) in expected.iter().enumerate() {
        let hit = hit.unwrap();
        let facing = hit.normal.dot((camera.world_from_eye.translation - moved_centre).normalize());
        if hit.object == 2 && facing > 0.8 {
            assert_eq!(drawn.object(pixel), 2);
            assert!((f64::from(drawn.w[pixel]) * hit.t - 1.0).abs() < 0.02);
            compared += 1;
        }
        if hit.object == 1 && still.object(pixel) == 1 && drawn.object(pixel) == 1 {
            assert_eq!(drawn.w[pixel], still.w[pixel], "the wall stays");
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn a_turned_object_turns_its_normals() {
    let stage = Stage::new();
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.0, 1.7, -6.0), 32, 50.0);
    let mut patch = capture(&[WALL], &camera);
    let at_capture = DAffine3::from_translation(DVec3::new(0.0, 1.7, -6.0));
    // Behind so many others that the table of moving objects takes a second row.
    let others = (100..200).map(|object| ObjectPose { object, world_from_object: DAffine3::IDENTITY });
    patch.patch.objects = others.chain([ObjectPose { object: 1, world_from_object: at_capture }]).collect();
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&patch);
    let turn = DQuat::from_rotation_y(0.5);
    surfaces.set_poses(&BTreeMap::from([(1, at_capture * DAffine3::from_quat(turn))]));
    let drawn = stage.draw(&surfaces, &camera, Smoothing::Blended);
    let middle = 16 * 32 + 16;
    assert!(drawn.normal(middle).dot((turn * DVec3::Z).as_vec3()) > 0.9999);
    assert!((drawn.w[middle] - 1.0 / 6.0).abs() < 0.01);
}

#[test]
fn ten_thousand_kilometres_from_the_origin_nothing_changes() {
    let stage = Stage::new();
    let far = DVec3::new(1e7, 0.0, -1e7);
    let picture = |origin: DVec3| {
        let mut camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.5, 0.8, -3.0), 64, 60.0);
        let mut patch = capture(&[WALL, FLOOR], &camera);
        let Camera::Pinhole(source) = &mut patch.patch.image.camera else { panic!("a pinhole took it") };
        source.world_from_eye.translation += origin;
        camera.world_from_eye =
            Rigid { translation: camera.world_from_eye.translation + origin + 0.125, ..camera.world_from_eye };
        stage.draw_patch(&patch, &camera)
    };
    let (near, far) = (picture(DVec3::ZERO), picture(far));
    let differ = (0..64 * 64).filter(|&pixel| near.colour[pixel] != far.colour[pixel]).count();
    // 1e7 m leaves 2e-9 m in f64: a boundary may fall on the other side of a pixel's centre, no more.
    assert!(differ <= 4, "{differ} pixels differ");
}

#[test]
fn bad_normals_and_extreme_depths_draw_no_nan() {
    let stage = Stage::new();
    let camera = view(DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.5, 0.8, -3.0), 64, 60.0);
    let mut patch = capture(&[WALL, FLOOR], &camera);
    let image = &mut patch.patch.image;
    for (index, normal) in image.normal.iter_mut().enumerate() {
        *normal = [(index % 256) as u8, (index / 7 % 256) as u8];
    }
    image.depth_scale = DepthScale { w_min: 1e-6, w_step: 1.0 / 4095.0 };
    for corners in [Corners::Averaged, Corners::OwnPlane] {
        let mut surfaces = HeldSurfaces::with_corners(&stage.gpu, corners, CornerRules::default());
        surfaces.insert(&patch);
        assert!(surfaces.stats().guarded > 0);
        let drawn = stage.draw(&surfaces, &camera, Smoothing::Blended);
        assert!(drawn.w.iter().all(|w| w.is_finite() && *w >= 0.0));
        assert_eq!(drawn.covered(), 64 * 64, "seen from its own eye every sample covers its pixel");
        let drawn = stage.draw(&surfaces, &view(DVec3::new(0.1, 1.6, 0.2), DVec3::NEG_Z, 64, 60.0), Smoothing::Blended);
        assert!(drawn.w.iter().all(|w| w.is_finite() && *w >= 0.0));
    }
}

/// A ball before a wall, both chequered by sample.
fn chequered(size_px: u32) -> (HeldPatch, [Shape; 2]) {
    let before = Shape::Sphere { centre: DVec3::new(-1.0, 0.0, -4.5), radius: 1.0 };
    let shapes = [WALL, before];
    let mut patch = capture(&shapes, &view(DVec3::ZERO, DVec3::NEG_Z, size_px, 60.0));
    let pixels: Vec<(u32, u32)> = patch.patch.image.mask.occupied().collect();
    for (colour, (x, y)) in patch.patch.image.colour.iter_mut().zip(pixels) {
        *colour = if (x + y) % 2 == 0 { [200, 100, 40] } else { [100, 60, 80] };
    }
    (patch, shapes)
}

#[test]
fn samples_finer_than_a_views_pixels_are_drawn_together_and_show_their_means() {
    let stage = Stage::new();
    let (patch, shapes) = chequered(256);
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&patch);
    let mut finest = HeldSurfaces::new(&stage.gpu).at_finest_level();
    finest.insert(&patch);
    for (size_px, level) in [(256, 0), (110, 1), (55, 2), (27, 3)] {
        let camera = view(DVec3::new(0.02, 0.01, 0.0), DVec3::new(0.02, 0.01, -1.0), size_px, 58.0);
        let (few, all) = (surfaces.quads_drawn(&camera), finest.quads_drawn(&camera));
        assert!(all > 256 * 256 * 9 / 10, "the view sees nearly all: {all}");
        // The ball's outline, some 300 pixels long, is drawn as finely as it is held.
        assert!(few <= (all >> (2 * level)) + (500 << level), "{few} of {all} at {size_px}");
        let (drawn, fine) = [&surfaces, &finest].map(|held| stage.draw(held, &camera, Smoothing::Blended)).into();
        assert!(drawn.covered() + 4 >= fine.covered(), "no cracks at {size_px}");
        let mut grey = 0;
        for (pixel, hit) in truth(&shapes, &camera).iter().enumerate() {
            let expected = 1.0 / hit.unwrap().t as f32;
            let is_of_outline = (fine.w[pixel] - expected).abs() > 0.01 * expected;
            assert!(is_of_outline || (drawn.w[pixel] - expected).abs() < 0.01 * expected, "{pixel} at {size_px}");
            grey += usize::from(drawn.colour[pixel][0].abs_diff(150) <= 2);
        }
        let share = grey as f64 / drawn.colour.len() as f64;
        assert!(if level == 0 { share < 0.2 } else { share > 0.9 }, "{share} at {size_px}");
    }
}

#[test]
fn deleted_samples_are_gone_at_every_level_and_what_no_view_sees_is_passed_over() {
    let stage = Stage::new();
    let (patch, _) = chequered(256);
    let mut surfaces = HeldSurfaces::new(&stage.gpu);
    surfaces.insert(&patch);
    let camera = view(DVec3::ZERO, DVec3::NEG_Z, 32, 60.0);
    let before = surfaces.quads_drawn(&camera);
    let square: Vec<(u16, u16)> = (0..64 * 64).map(|at| (128 + at % 64, 128 + at / 64)).collect();
    surfaces.delete(PatchId(1), &square);
    let drawn = stage.draw(&surfaces, &camera, Smoothing::Blended);
    assert_eq!(drawn.covered(), 32 * 32 - 8 * 8);
    assert!(surfaces.quads_drawn(&camera) < before + 64 * 64, "other parts stay coarse");
    // A narrow view beside what was deleted.
    let narrow = view(DVec3::ZERO, DVec3::new(-0.3, 0.2, -1.0), 64, 8.0);
    assert_eq!(stage.draw(&surfaces, &narrow, Smoothing::Blended).covered(), 64 * 64);
    let part = surfaces.quads_drawn(&narrow);
    assert!(part < 256 * 256 / 8, "{part}");
    assert_eq!(surfaces.quads_drawn(&view(DVec3::ZERO, DVec3::Z, 64, 60.0)), 0);
}

#[test]
fn what_was_trimmed_bit_by_bit_is_drawn_as_what_was_trimmed_at_once() {
    let stage = Stage::new();
    let shapes = [FLOOR, WALL, Shape::Sphere { centre: DVec3::new(0.3, 1.2, -3.0), radius: 0.8 }];
    let (eye, target) = (DVec3::new(0.0, 1.7, 0.0), DVec3::new(0.2, 0.8, -3.0));
    let mut patch = capture(&shapes, &view(eye, target, 96, 70.0));
    let mut on_gpu = HeldSurfaces::new(&stage.gpu);
    let mut pass = AddressPass::on_host();
    let mut on_host = pass.new_surfaces();
    on_gpu.insert(&patch);
    on_host.insert(&patch);
    patch.trims = vec![0; patch.patch.image.sample_count()];
    let pixels: Vec<(u16, u16)> = patch.patch.image.mask.occupied().map(|(x, y)| (x as u16, y as u16)).collect();
    let beside = view(eye + DVec3::new(0.5, 0.1, 0.3), target, 128, 70.0);
    let mut before = stage.draw(&on_gpu, &beside, Smoothing::Blended).w;
    for step in 0..4_usize {
        // A block of samples that grows over the ball's outline, and single ones; some are trimmed for a second time.
        let is_trimmed = |&(sample, _): &(usize, &(u16, u16))| {
            let (x, y) = (sample % 96, sample / 96);
            (40 + step..52 + 2 * step).contains(&x) && (30..34 + step).contains(&y) || sample % 1301 == step
        };
        let trimmed: Vec<(usize, (u16, u16))> =
            pixels.iter().enumerate().filter(is_trimmed).map(|(sample, &pixel)| (sample, pixel)).collect();
        trimmed.iter().for_each(|&(sample, _)| patch.trims[sample] = (patch.trims[sample] + 1).min(3));
        let trimmed: Vec<(u16, u16)> = trimmed.into_iter().map(|(_, pixel)| pixel).collect();
        on_gpu.trim(&patch, &trimmed);
        on_host.trim(&patch, &trimmed);
        let (mut gpu_anew, mut host_anew) = (HeldSurfaces::new(&stage.gpu), pass.new_surfaces());
        gpu_anew.insert(&patch);
        host_anew.insert(&patch);
        let [bits, once] = [&on_gpu, &gpu_anew].map(|surfaces| stage.draw(surfaces, &beside, Smoothing::Blended));
        assert!(bits.w == once.w && bits.colour == once.colour, "step {step}");
        assert_ne!(bits.w, before, "step {step}");
        let [bits, once] = [&on_host, &host_anew].map(|surfaces| pass.view(surfaces, &beside).expect("a view").texels);
        let addresses = |texels: &[AddressTexel]| texels.iter().map(AddressTexel::address).collect::<Vec<_>>();
        assert_eq!(addresses(&bits), addresses(&once), "step {step}");
        before = stage.draw(&on_gpu, &beside, Smoothing::Blended).w;
    }
}

#[test]
fn what_is_edited_as_it_comes_is_drawn_as_what_is_edited_later() {
    let (stage, camera) = (Stage::new(), view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64, 50.0));
    let shapes = [Shape::Sphere { centre: DVec3::ZERO, radius: 1.0 }];
    let patch = capture(&shapes, &camera).patch;
    let add = Edit::Add(Box::new(patch.clone()));
    let pixels: Vec<(u16, u16)> = patch.image.mask.occupied().map(|(x, y)| (x as u16, y as u16)).collect();
    let deleted = Edit::Delete(patch.id, pixels.iter().step_by(31).copied().collect());
    let rest = pixels.iter().enumerate().filter(|(at, _)| at % 31 != 0);
    let trimmed = Edit::Trim(patch.id, rest.step_by(40).map(|(_, &(x, y))| (x, y, 2)).collect());
    let draw = |updates: &[&[&Edit]], beside: bool| {
        let (mut held, mut surfaces) = (Held::default(), HeldSurfaces::new(&stage.gpu));
        for edits in updates {
            let update = held.commit(edits.iter().copied().cloned().collect(), 0.0, 0).expect("sound edits");
            let built = surfaces.build().surfaces(&update).filter(|_| beside);
            surfaces.apply_built(&held, &update, &mut built.collect());
        }
        let drawn = stage.draw(&surfaces, &camera, Smoothing::default());
        (drawn.colour, drawn.normal_ids, drawn.w)
    };
    let later = draw(&[&[&add], &[&deleted, &trimmed]], false);
    assert!(draw(&[&[&add]], true) == draw(&[&[&add]], false) && draw(&[&[&add]], true) != later);
    assert!(draw(&[&[&add, &deleted, &trimmed]], true) == later);
}

#[test]
fn parts_that_turn_away_are_passed_over_where_surfaces_have_one_side() {
    let stage = Stage::new();
    let ball = [Shape::Sphere { centre: DVec3::new(0.0, 0.0, -4.0), radius: 1.0 }];
    let patch = capture(&ball, &view(DVec3::ZERO, DVec3::NEG_Z, 256, 60.0));
    let held = patch.patch.image.mask.count();
    let mut surfaces = HeldSurfaces::new(&stage.gpu).at_finest_level();
    surfaces.insert(&patch);
    let quads_at = |surfaces: &HeldSurfaces, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let eye = DVec3::new(4.0 * sin, 0.0, -4.0 + 4.0 * cos);
        surfaces.quads_drawn(&view(eye, DVec3::new(0.0, 0.0, -4.0), 256, 60.0))
    };
    assert_eq!(quads_at(&surfaces, 180.0), held, "nobody has said how many sides it has");
    let side = Material { double_sided: false, ..Material::default() };
    surfaces.set_materials(&[side; 16]);
    assert_eq!(quads_at(&surfaces, 0.0), held);
    assert_eq!(quads_at(&surfaces, 180.0), 0);
    let aside = quads_at(&surfaces, 90.0);
    assert!(aside > held * 2 / 5 && aside < held * 9 / 10, "{aside} of {held}");
}
