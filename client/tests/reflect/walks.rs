//! The ways in which rays walk find the same, and take the steps that the CPU counts; tiles leave out no ray.

use impostor::{Impostor, Method, Ray, Steps};

use super::*;

const WALKS: [Walk; 4] = [Walk::Fine, Walk::Coarse { coarse_px: 6 }, Walk::Hierarchy, Walk::TwoPass];

/// One round of rays, so that the CPU can say what they meet.
const ONCE: Settings = Settings { bounces: Bounces::One, fade: false, ..SHARP };

/// The pot, painted by place, between the mirror and the eye, with its front to the mirror; and the way there.
fn pot() -> (ImpostorImage, Impostor, DAffine3) {
    let image = scenes::pot_by_spoc(512);
    let sample = |shown: &Option<support::Shown>| match shown {
        Some(shown) => {
            (Sample { w: shown.w, normal_world: shown.normal }, fields(shown.p_world.x * 2.0, shown.p_world.y * 2.0))
        }
        None => (Sample::EMPTY, [0; 4]),
    };
    let (samples, colour) = image.shown.iter().map(sample).unzip();
    let camera = image.impostor.camera().clone();
    let image_of_pot =
        ImpostorImage { kind: ImpostorKind::Object(7), camera, samples, colour, pose: Some((7, DAffine3::IDENTITY)) };
    let pot_from_now =
        DAffine3::from_rotation_y(std::f64::consts::PI) * DAffine3::from_translation(DVec3::new(0.2, 0.1, -1.5));
    (image_of_pot, image.impostor, pot_from_now)
}

fn held_before_pot(pot_from_now: DAffine3) -> Held {
    let mut held = held(MIRROR, 1.5);
    held.poses_now = BTreeMap::from([(7, pot_from_now.inverse())]);
    held
}

/// The rays off the mirror, where the pot was captured.
fn rays(pot_from_now: DAffine3) -> impl Iterator<Item = Ray> {
    (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))).map(move |(x, y)| {
        let direction = (way(x, y) * DVec3::new(1.0, 1.0, -1.0)).normalize();
        let origin = way(x, y) * WALL_M;
        Ray::endless(pot_from_now.transform_point3(origin), pot_from_now.transform_vector3(direction))
    })
}

/// Whether a pixel shows a colour, but for rounding.
fn is_near(pixel: &[u8; 4], colour: [u8; 3]) -> bool {
    pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(b) <= 2)
}

/// Pixels that show something else.
fn differing(a: &Shown, b: &Shown) -> usize {
    let differ = |&(a, b): &(&[u8; 4], &[u8; 4])| !is_near(a, [b[0], b[1], b[2]]);
    a.pixels.iter().zip(&b.pixels).filter(differ).count()
}

#[test]
fn every_way_to_walk_shows_the_same() {
    let (image, _, pot_from_now) = pot();
    let (held, images) = (held_before_pot(pot_from_now), [image, behind(ImpostorKind::Environment)]);
    let by = |walk| show(&held, &images, Settings { walk, search: Search::Quarter, ..SHARP });
    let hierarchy = by(Walk::Hierarchy);
    let without_pot = show(&held, &images[1..], SHARP);
    assert!(differing(&hierarchy, &without_pot) > 200, "the pot is in the mirror");
    for walk in WALKS {
        // Rays that graze an outline fall on either side of it.
        assert!(differing(&by(walk), &hierarchy) <= 4, "{walk:?}: {}", differing(&by(walk), &hierarchy));
    }
}

#[test]
fn the_gpu_takes_the_steps_that_the_cpu_counts() {
    let (image, impostor, pot_from_now) = pot();
    let held = held_before_pot(pot_from_now);
    let ways = [
        (Walk::Fine, Method::Fine, 0.01),
        (Walk::Coarse { coarse_px: 6 }, Method::Coarse { coarse_px: 6.0 }, 0.01),
        (Walk::Coarse { coarse_px: 12 }, Method::Coarse { coarse_px: 12.0 }, 0.01),
        // The twins bound the length of what is halved in two ways.
        (Walk::Hierarchy, Method::Hierarchy, 0.1),
    ];
    for (walk, method, most) in ways {
        for (search, fine_px) in [(Search::Quarter, 0.25), (Search::Half, 0.5), (Search::Whole, 1.0)] {
            let settings = Settings { walk, search, count_steps: true, ..ONCE };
            let shown = show(&held, std::slice::from_ref(&image), settings);
            let found: Vec<_> = rays(pot_from_now).map(|ray| impostor.hit(&ray, Steps { method, fine_px })).collect();
            let steps: u32 = found.iter().map(|search| search.count.steps()).sum();
            let StepSum { steps: on_gpu, walks } = shown.steps.expect("steps");
            assert_eq!(walks, f64::from(SIDE * SIDE));
            let ratio = on_gpu / f64::from(steps);
            assert!((ratio - 1.0).abs() < most, "{walk:?}, {search:?}: {ratio} of {steps}");
            let hits = found.iter().filter(|search| search.hit.is_some()).count();
            let shown_hits = shown.pixels.iter().filter(|pixel| !is_near(pixel, BACKGROUND)).count();
            assert!(hits > 200 && shown_hits.abs_diff(hits) <= 4, "{walk:?}: {shown_hits}, {hits}");
        }
    }
}

#[test]
fn two_passes_take_fewer_steps_where_one_surface_is_met() {
    let images = [behind(ImpostorKind::Environment), behind(ImpostorKind::Object(9))];
    let held = held(MIRROR, 1.5);
    let steps = |walk| {
        let shown = show(&held, &images, Settings { walk, count_steps: true, ..ONCE });
        shown.is(fields_at(WALL_M + 5.0, 0.07));
        shown.steps.expect("steps")
    };
    let (one, two) = (steps(Walk::Hierarchy), steps(Walk::TwoPass));
    assert!(two.walks < one.walks * 0.75 && two.steps < one.steps * 0.75, "{two:?}, {one:?}");
}

/// A wall with slits of less than two pixels, wider apart than the low resolution's rays: they miss some of them.
#[test]
fn what_guided_rays_do_not_find_is_looked_for_in_all_impostors() {
    let is_slit = |x: f64| (x / 0.63).rem_euclid(1.0) < 0.3;
    let wall = plane(pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 512), ImpostorKind::Object(9), 3.0, |x, y| {
        (!is_slit(x)).then(|| fields(x, y))
    });
    let beyond = plane(pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 512), ImpostorKind::Environment, 5.0, |_, _| {
        Some([200, 30, 60, UNLIT])
    });
    let images = [wall, beyond];
    let by = |walk| show(&held(MIRROR, 1.5), &images, Settings { walk, ..SHARP });
    let (hierarchy, two) = (by(Walk::Hierarchy), by(Walk::TwoPass));
    let through = hierarchy.pixels.iter().filter(|pixel| is_near(pixel, [200, 30, 60])).count();
    assert!(through > 400, "{through}");
    assert_eq!(differing(&hierarchy, &two), 0);
}

#[test]
fn mirrors_of_one_pixel_show_what_they_reflect_wherever_they_are() {
    let places = [
        (0, 0),
        (63, 0),
        (1, 1),
        (1, 63),
        (63, 63),
        (8, 1),
        (15, 17),
        (1, 2),
        (2, 5),
        (9, 10),
        (10, 9),
        (37, 21),
        (42, 42),
    ];
    let images = [behind(ImpostorKind::Environment)];
    let mut held = held(ROUGH, 1.5);
    let patch = held.patches.get_mut(&PatchId(1)).expect("the wall");
    for (x, y) in places {
        patch.patch.image.material[(y * SIDE + x) as usize] = MIRROR;
    }
    let expected = fields_at(WALL_M + 5.0, 0.07);
    for walk in [Walk::Hierarchy, Walk::TwoPass] {
        let shown = show(&held, &images, Settings { walk, ..SHARP });
        let known = places.into_iter().filter_map(|(x, y)| Some((shown.at(x, y), expected(x, y)?)));
        let known: Vec<_> = known.collect();
        assert!(known.len() >= 7, "{} of them lie within a field", known.len());
        for ([red, green, blue], colour) in known {
            assert!(is_near(&[red, green, blue, 255], colour), "{walk:?}: {colour:?}");
        }
    }
}
