//! A car park with 40 cars, a quarter of them driving around it.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DAffine3, DVec2, dvec2, dvec3, vec3};

use super::car::{Car, Shape, rolled_m};
use super::kit::Kit;
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;
use super::track::Track;

const PERIOD_S: f64 = 24.0;
const PARKED_A_ROW: usize = 10;
const ROWS: usize = 3;
const DRIVING: usize = 10;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(21.0, 9.5, 20.0), dvec3(0.0, 0.0, 0.5));
    let asphalt = kit.textured("asphalt", texture::mottled(0x66666a, 8, 0.10));
    let mut ground = Mesher::new();
    ground.uv_per_m(0.15).cuboid_cells(vec3(-23.0, -0.3, -18.0), vec3(23.0, 0.0, 18.0), [12, 1, 9]);
    let ground = kit.mesh(ground, asphalt);
    kit.place("ground", ground, DAffine3::IDENTITY);

    let paint = kit.painted("car paint");
    let wheel = Car::wheel(&mut kit, paint);
    let shapes = [Shape::Saloon, Shape::Hatchback, Shape::Van];
    let tones = [0xb3262a, 0x2f5f9e, 0xd9d7d0, 0x33363b, 0xd2a021, 0x4f7d5a, 0x8d9aa6];
    let bodies = shapes.map(|shape| Car::new(&mut kit, paint, shape, 0xffffff, wheel));
    let models: Vec<Car> =
        (0..bodies.len() * tones.len()).map(|k| bodies[k % bodies.len()].in_tone(tones[k % tones.len()])).collect();
    let mut rng = Rng::new(40);
    lines(&mut kit, paint);
    for k in 0..PARKED_A_ROW * ROWS {
        let (x, z) = bay(k % PARKED_A_ROW, k / PARKED_A_ROW);
        let yaw = if rng.unit() < 0.5 { 0.0 } else { PI } + f64::from(rng.range(-0.04, 0.04));
        let place = DAffine3::from_translation(dvec3(x, 0.0, z)) * DAffine3::from_rotation_y(yaw);
        models[rng.index(models.len())].drive(&mut kit, &(Arc::new(move |_: f64| (place, 0.0)) as _));
    }
    let track = Arc::new(Track::rectangle(DVec2::ZERO, dvec2(19.0, 14.2), 6.0, false));
    let lap = track.length_m();
    for k in 0..DRIVING {
        let track = Arc::clone(&track);
        let start = k as f64 / DRIVING as f64 + f64::from(rng.range(-0.02, 0.02));
        let drive = move |share: f64| (track.pose((start + share) * lap, 0.0, 1.3), share * rolled_m(lap));
        models[rng.index(models.len())].drive(&mut kit, &(Arc::new(drive) as _));
    }
    kit
}

/// The middle of a bay.
fn bay(column: usize, row: usize) -> (f64, f64) {
    ((column as f64 - (PARKED_A_ROW as f64 - 1.0) / 2.0) * 3.0, (row as f64 - 1.0) * 7.4)
}

/// Painted lines between bays, thin enough to drive over.
fn lines(kit: &mut Kit, paint: u32) {
    let mut line = Mesher::new();
    line.paint(0xe4e0d4).cuboid(vec3(-2.6, 0.0, -0.06), vec3(2.6, 0.012, 0.06));
    let line = kit.mesh(line, paint);
    for (column, row) in (0..=PARKED_A_ROW).flat_map(|c| (0..ROWS).map(move |r| (c, r))) {
        let (x, z) = bay(column, row);
        let place = DAffine3::from_translation(dvec3(x - 1.5, 0.0, z)) * DAffine3::from_rotation_y(FRAC_PI_2);
        kit.place("line", line, place);
    }
}
