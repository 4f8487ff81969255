//! A car all of chrome on a car park between painted cars and houses: a body, bumpers, hubs and mirrors, each an object that reflects.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use camera::Trace;
use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3, vec3};

use super::car::{Car, Shape, rolled_m};
use super::kit::{Kit, path as path_of};
use super::mesher::Mesher;
use super::reflecting::silver;
use super::texture;
use super::track::Track;

const PERIOD_S: f64 = 24.0;
/// About the middle of the car.
const MIDDLE_WORLD: DVec3 = dvec3(0.0, 0.65, 0.0);
/// From there to the eyes of the path.
const EYE_AWAY_M: f64 = 3.4;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(2.7, 1.6, 2.4), MIDDLE_WORLD);
    place(&mut kit);
    let paint = kit.painted("car paint");
    let wheel = Car::wheel(&mut kit, paint);
    painted_cars(&mut kit, paint, wheel);
    let chrome = silver(&mut kit);
    let car = Car::new(&mut kit, chrome, Shape::Saloon, 0xf2f2f4, wheel).called("chrome body mirror");
    car.drive(&mut kit, &(Arc::new(|_: f64| (DAffine3::IDENTITY, 0.0)) as _));
    fittings(&mut kit, chrome);
    kit
}

/// Asphalt, and houses of several tones around it.
fn place(kit: &mut Kit) {
    let asphalt = kit.textured("asphalt", texture::tiles([0x66666a, 0x7a7a7c], 0x55565a, 4));
    let mut ground = Mesher::new();
    ground.uv_per_m(0.25).cuboid_cells(vec3(-16.0, -0.3, -16.0), vec3(16.0, 0.0, 16.0), [8, 1, 8]);
    let ground = kit.mesh(ground, asphalt);
    kit.place("ground", ground, DAffine3::IDENTITY);
    let brick = kit.textured("brick", texture::brick(0xffffff, 0xbdb5a6, [4, 8], 0.06));
    let tones = [0xb9805f, 0x9fa889, 0xc4b07c, 0x8f9bab, 0xb59a9a];
    for k in 0..12 {
        let height_m = 4.0 + 1.5 * ((k * 5) % 4) as f32;
        let mut house = Mesher::new();
        house.paint(tones[k % tones.len()]).uv_per_m(0.4);
        house.cuboid_cells(vec3(-3.4, 0.0, -2.0), vec3(3.4, height_m, 2.0), [3, 3, 2]);
        let house = kit.mesh(house, brick);
        // Three houses a side.
        let turn = DAffine3::from_rotation_y(FRAC_PI_2 * (k / 3) as f64);
        let at = dvec3(7.5 * ((k % 3) as f64 - 1.0), 0.0, -14.0);
        kit.place("house", house, turn * DAffine3::from_translation(at));
    }
}

/// Parked ones beside the chrome one, and one that goes round them all.
fn painted_cars(kit: &mut Kit, paint: u32, wheel: u32) {
    let shapes = [Shape::Hatchback, Shape::Van, Shape::Saloon];
    let bodies = shapes.map(|shape| Car::new(kit, paint, shape, 0xffffff, wheel));
    let tones = [0xb3262a, 0x2f5f9e, 0xd2a021, 0x4f7d5a, 0xd9d7d0];
    let bays = [(-5.0, 0.3), (-5.2, 5.2), (5.6, -3.0), (0.2, -6.4), (6.0, 4.6)];
    for (k, (&tone, (x, z))) in tones.iter().zip(bays).enumerate() {
        let place = DAffine3::from_translation(dvec3(x, 0.0, z)) * DAffine3::from_rotation_y(PI * (k % 2) as f64);
        bodies[k % bodies.len()].in_tone(tone).drive(kit, &(Arc::new(move |_: f64| (place, 0.0)) as _));
    }
    let track = Arc::new(Track::rectangle(DVec2::ZERO, dvec2(9.5, 9.5), 4.0, false));
    let lap_m = track.length_m();
    let drive = move |share: f64| (track.pose((0.1 + share) * lap_m, 0.0, 1.3), share * rolled_m(lap_m));
    bodies[0].in_tone(0xe07b28).drive(kit, &(Arc::new(drive) as _));
}

/// Bumpers, hubs and mirrors.
fn fittings(kit: &mut Kit, chrome: u32) {
    let mut bumper = Mesher::new();
    bumper.capsule([vec3(-0.82, 0.0, 0.0), vec3(0.82, 0.0, 0.0)], [0.09, 0.09], [24, 8]);
    let bumper = kit.mesh(bumper, chrome);
    let mut hub = Mesher::new();
    hub.ellipsoid(vec3(0.05, 0.17, 0.17), [32, 16]);
    let hub = kit.mesh(hub, chrome);
    let mut mirror = Mesher::new();
    mirror.ellipsoid(vec3(0.11, 0.08, 0.07), [32, 16]);
    let mirror = kit.mesh(mirror, chrome);
    for z in [-2.22, 2.24] {
        kit.place("chrome bumper mirror", bumper, DAffine3::from_translation(dvec3(0.0, 0.4, z)));
    }
    for (x, z) in [(-0.92, -1.28), (0.92, -1.28), (-0.92, 1.30), (0.92, 1.30)] {
        kit.place("chrome hub mirror", hub, DAffine3::from_translation(dvec3(x, 0.32, z)));
    }
    for x in [-0.95, 0.95] {
        kit.place("chrome wing mirror", mirror, DAffine3::from_translation(dvec3(x, 1.02, 0.78)));
    }
}

/// 90 degrees around the car, from its side to its front.
pub(super) fn path() -> Trace {
    path_of(|share, _| {
        let angle = TAU / 4.0 * share;
        (MIDDLE_WORLD + dvec3(angle.cos(), 0.28, angle.sin()) * EYE_AWAY_M, MIDDLE_WORLD)
    })
}
