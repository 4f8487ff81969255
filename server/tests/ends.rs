//! Where surfaces end within a pixel, beside shapes whose outlines are known.

mod common;

use camera::{ImagePoint, Pinhole};
use common::{captures, coloured, looking_back, renderer, scene, sphere, square};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use protocol::ends::{self, SIDES};
use scene::Scene;
use vantage_server::discretize::{Capture, Discretization, EndsPass};

const SIZE_PX: u32 = 64;

/// Captures of a scene, with all of their ends.
fn told(scene: &Scene, cameras: &[Pinhole], method: Discretization) -> Vec<Capture> {
    let gpu = common::gpu();
    let renderer = renderer(&gpu, scene, &cameras[0]);
    let mut pass = EndsPass::new(&renderer).expect("pipelines");
    let mut captures = captures(&renderer, cameras, method);
    for capture in &mut captures {
        let mask = capture.mask();
        pass.tell(&renderer, capture, &mask).expect("drawn");
    }
    captures
}

/// By how much the ends of an object differ from how much of it there is, in pixels: of all sides where a sample of it is next to a pixel without. Panics
/// where one of them says nothing, or where any other side says anything. `is_inside` tells whether an image point is of it, and
/// `counts` which pixels are asked.
fn errors(
    capture: &Capture,
    object: u16,
    is_inside: &dyn Fn(DVec2) -> bool,
    counts: &dyn Fn(DVec2) -> bool,
) -> Vec<f64> {
    let (width, height) = (capture.camera.width_px as i32, capture.camera.height_px as i32);
    let mut errors = Vec::new();
    for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
        let index = (y * width + x) as usize;
        let centre = DVec2::new(x.into(), y.into()) + 0.5;
        if capture.ids[index][0] == 0 || !counts(centre) {
            continue;
        }
        for (side, step) in SIDES.iter().enumerate() {
            let next = DVec2::new(step[0].into(), step[1].into());
            let ends = capture.object(index) == object && is_inside(centre) && !is_inside(centre + next);
            let said = ends::reach(capture.ends[index], side);
            assert_eq!(said.is_some(), ends, "side {side} of ({x}, {y})");
            if let Some(said) = said {
                errors.push(f64::from(said) - covered(is_inside, centre, next));
            }
        }
    }
    errors
}

/// How much of the strip from a pixel's centre to the next is inside, a pixel wide.
fn covered(is_inside: &dyn Fn(DVec2) -> bool, centre: DVec2, next: DVec2) -> f64 {
    const PARTS: i32 = 60;
    let place = |part: i32| (f64::from(part) + 0.5) / f64::from(PARTS);
    let places = (0..PARTS).flat_map(|along| (0..PARTS).map(move |aside| (place(along), place(aside) - 0.5)));
    let inside = places.filter(|&(along, aside)| is_inside(centre + along * next + aside * next.perp()));
    inside.count() as f64 / f64::from(PARTS * PARTS)
}

fn worst_and_mean(errors: &[f64]) -> (f64, f64) {
    let mean = errors.iter().map(|error| error.abs()).sum::<f64>() / errors.len() as f64;
    (errors.iter().fold(0.0, |worst, error| worst.max(error.abs())), mean)
}

/// A card of two half sides, 2 m before the origin, turned in its plane; where an image point is in it, and how far from its corners in pixels.
struct Card {
    world_from_card: DAffine3,
    half_m: DVec2,
}

impl Card {
    fn new(half_m: DVec2, turn_rad: f64, shift_m: DVec2) -> Card {
        let place = shift_m.extend(-2.0);
        Card { world_from_card: DAffine3::from_rotation_translation(DQuat::from_rotation_z(turn_rad), place), half_m }
    }

    fn placed(&self) -> (u32, DAffine3) {
        (0, self.world_from_card * DAffine3::from_scale(self.half_m.extend(1.0)))
    }

    fn on_card(&self, camera: &Pinhole, point: DVec2) -> DVec2 {
        let world = camera.world_from_image(ImagePoint { u: point.x, v: point.y, w: 0.5 });
        self.world_from_card.inverse().transform_point3(world).truncate()
    }

    fn holds(&self, camera: &Pinhole, point: DVec2) -> bool {
        self.on_card(camera, point).abs().cmple(self.half_m).all()
    }

    fn is_far_from_corners(&self, camera: &Pinhole, point: DVec2) -> bool {
        let pixel_m = 2.0 / camera.focal_px;
        (self.on_card(camera, point).abs() - self.half_m).length() > 3.0 * pixel_m
    }
}

fn wall() -> (u32, DAffine3) {
    (0, DAffine3::from_translation(DVec3::Z * -4.0) * DAffine3::from_scale(DVec3::splat(8.0)))
}

fn white() -> Vec<scene::Material> {
    vec![coloured([1.0; 4])]
}

#[test]
fn straight_outlines_lie_where_they_are_said_to() {
    let camera = looking_back(DVec3::ZERO, SIZE_PX);
    for (turn_rad, most, most_mean) in [(0.0, 1.0 / 6.0, 0.1), (0.35, 0.17, 0.06), (0.75, 0.17, 0.08)] {
        for (index, before_wall) in [false, true].into_iter().enumerate() {
            let card = Card::new(DVec2::new(1.13, 0.71), turn_rad, DVec2::new(0.013 + 0.01 * index as f64, -0.021));
            let placed = [card.placed(), wall()];
            let scene = scene(vec![square(1, 0)], white(), &placed[..1 + usize::from(before_wall)]);
            let capture = &told(&scene, &[camera], Discretization::Conventional)[0];
            let errors = errors(capture, 0, &|point| card.holds(&camera, point), &|point| {
                card.is_far_from_corners(&camera, point)
            });
            let (worst, mean) = worst_and_mean(&errors);
            eprintln!("turned by {turn_rad}: worst {worst:.3}, mean {mean:.3} of {}", errors.len());
            assert!(errors.len() > 60 && worst < most + 0.01 && mean < most_mean, "{worst} {mean}");
        }
    }
}

#[test]
fn what_is_thinner_than_a_pixel_gets_its_width() {
    let camera = looking_back(DVec3::ZERO, SIZE_PX);
    // 0.4 pixels wide at 2 m, nearly upright: about two rows of five have a sample.
    let card = Card::new(DVec2::new(0.2 * 2.0 / camera.focal_px, 1.2), 0.13, DVec2::ZERO);
    let scene = scene(vec![square(1, 0)], white(), &[card.placed(), wall()]);
    let capture = &told(&scene, &[camera], Discretization::Conventional)[0];
    let of_card = (0..capture.ids.len()).filter(|&index| capture.object(index) == 0);
    let widths: Vec<f32> = of_card
        .filter_map(|index| Some(ends::reach(capture.ends[index], 0)? + ends::reach(capture.ends[index], 2)?))
        .collect();
    let mean = widths.iter().sum::<f32>() / widths.len() as f32;
    assert!(widths.len() > 12 && (mean - 0.4).abs() < 0.06, "{mean} of {}", widths.len());
}

#[test]
fn a_round_outline_lies_where_it_is_said_to() {
    let camera = looking_back(DVec3::ZERO, SIZE_PX);
    let ball = DAffine3::from_translation(DVec3::Z * -2.5) * DAffine3::from_scale(DVec3::splat(0.7));
    let scene = scene(vec![square(1, 0), sphere(96, 0)], white(), &[wall(), (1, ball)]);
    let capture = &told(&scene, &[camera], Discretization::Conventional)[0];
    // The tangent of the angle to a ray that touches it.
    let radius_px = camera.focal_px * 0.7 / (2.5_f64.powi(2) - 0.7_f64.powi(2)).sqrt();
    let is_inside = |point: DVec2| (point - camera.centre_px).length() < radius_px;
    let (worst, mean) = worst_and_mean(&errors(capture, 1, &is_inside, &|_| true));
    assert!(worst < 0.3 && mean < 0.08, "worst {worst}, mean {mean}");
}

#[test]
fn a_surface_that_goes_on_in_an_earlier_image_says_nothing() {
    let cameras = [0.0, 0.3].map(|x| looking_back(DVec3::X * x, SIZE_PX));
    let card = Card::new(DVec2::new(0.7, 0.7), 0.35, DVec2::ZERO);
    let scene = scene(vec![square(1, 0)], white(), &[card.placed(), wall()]);
    let captures = told(&scene, &cameras, Discretization::SURFACE);
    let held = captures[1].mask();
    assert!(held.count() > 50 && held.count() < 1500, "what the first eye did not see: {}", held.count());
    // Of the wall's samples none ends, though its strip does, on the side that the first image holds as well.
    let of_wall =
        (0..captures[1].ids.len()).filter(|&index| captures[1].ids[index][0] != 0 && captures[1].object(index) == 1);
    assert!(of_wall.clone().count() > 50 && of_wall.clone().all(|index| captures[1].ends[index] == 0));
}
