//! Six blocks of a small town: terraces around it, houses with gardens, trees, lamps, cars and people.
//!
//! Blocks are 36 m wide, streets 12 m; the terraces close every street's view. y = 0 is the road.

mod ground;
mod house;
mod street;

use std::sync::Arc;

use glam::{DAffine3, DVec2, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};

use super::car::{Car, Shape, rolled_m};
use super::figure::{Figure, STRIDE_M, WARDROBE};
use super::kit::{EYE_HEIGHT_M, Kit, camera};
use super::rng::Rng;
use super::texture;
use super::track::Track;
use crate::model::SceneCamera;
use ground::{BLOCK_M, KERB_M, PAVEMENT_M, blocks, outer};
use house::Plan;

const PERIOD_S: f64 = 120.0;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.walk = true;
    kit.daylight();
    kit.look(dvec3(-32.0, KERB_M + EYE_HEIGHT_M, 7.0), dvec3(-4.0, 2.9, -1.0));
    let mut rng = Rng::new(1604);
    street::build(&mut kit);
    houses(&mut kit, &mut rng);
    terraces(&mut kit, &mut rng);
    street::furniture(&mut kit, &mut rng);
    cars(&mut kit, &mut rng);
    people(&mut kit);
    kit
}

fn wall_materials(kit: &mut Kit) -> [u32; 3] {
    [
        kit.textured("brick", texture::brick(0xffffff, 0xd8d0c4, [6, 16], 0.09)),
        kit.textured("render", texture::mottled(0xf6f4f0, 8, 0.06)),
        kit.textured("stone", texture::brick(0xf4f0e8, 0xc4bcae, [3, 6], 0.05)),
    ]
}

/// Tones that suit each wall material.
fn plan(rng: &mut Rng, kind: usize) -> Plan {
    let walls: [&[u32]; 3] = [
        &[0xa8573f, 0xb8735a, 0x8f4a3c, 0xb08a68],
        &[0xe3d3ac, 0xc9d4cf, 0xd9a98a, 0xe8e2d4, 0x9fb3a4, 0xd8bf7a],
        &[0xcabfa8, 0xb9b2a4, 0xd6c9a8],
    ];
    Plan {
        width_m: rng.range(8.2, 9.4),
        depth_m: rng.range(8.4, 9.6),
        floors: 2 + rng.index(2),
        windows: [3, 1, 1],
        flat_roof: rng.unit() < 0.2,
        tones: [
            rng.pick(walls[kind]),
            rng.pick(&[0xf2efe8, 0xe4ddcc, 0xd9d9d6]),
            rng.pick(&[0x2f5a45, 0x7a2f2a, 0x2d4664, 0x5a3d28, 0xc29a3a]),
            rng.pick(&[0x9c4f38, 0x6f5a52, 0x59606a, 0x84503c]),
        ],
    }
}

/// Two rows of three houses on each block, fronts to the streets along x.
fn houses(kit: &mut Kit, rng: &mut Rng) {
    let walls = wall_materials(kit);
    let trim = kit.painted("trim");
    for block in blocks() {
        for (row, column) in [(-1.0, 0), (-1.0, 1), (-1.0, 2), (1.0, 0), (1.0, 1), (1.0, 2)] {
            let kind = rng.index(walls.len());
            let plan = plan(rng, kind);
            let x = block.x + (f64::from(column) - 1.0) * 10.2;
            let front = BLOCK_M / 2.0 - PAVEMENT_M - 1.0;
            let z = block.y + row * (front - f64::from(plan.depth_m) / 2.0);
            let yaw = if row > 0.0 { 0.0 } else { PI };
            let place = DAffine3::from_translation(dvec3(x, KERB_M, z)) * DAffine3::from_rotation_y(yaw);
            house::build(kit, &plan, [walls[kind], trim], place, rng);
        }
    }
}

/// Unbroken rows of taller houses around the outer streets, facing inwards.
fn terraces(kit: &mut Kit, rng: &mut Rng) {
    let walls = wall_materials(kit);
    let trim = kit.painted("terrace trim");
    let depth = 9.0;
    let edge = outer() + DVec2::splat(PAVEMENT_M);
    for (along, across, yaw) in [(edge.x, edge.y, 0.0), (edge.y, edge.x, FRAC_PI_2)] {
        for turned in [0.0, PI] {
            let world_from_row = DAffine3::from_rotation_y(yaw + turned);
            let count = (2.0 * along / 16.5).round();
            let width = 2.0 * along / count;
            for k in 0..count as usize {
                let kind = rng.index(walls.len());
                let mut plan = plan(rng, kind);
                plan.width_m = width as f32;
                plan.depth_m = depth as f32;
                plan.floors = 3;
                plan.windows = [3, 0, 0];
                let x = -along + (k as f64 + 0.5) * width;
                let place = DAffine3::from_translation(dvec3(x, KERB_M, -across - depth / 2.0));
                house::build(kit, &plan, [walls[kind], trim], world_from_row * place, rng);
            }
        }
    }
}

/// Cars go around the blocks on the right; some more are parked.
fn cars(kit: &mut Kit, rng: &mut Rng) {
    let paint = kit.painted("car paint");
    let wheel = Car::wheel(kit, paint);
    let shapes = [Shape::Saloon, Shape::Hatchback, Shape::Van];
    let tones = [0xb3262a, 0x2f5f9e, 0xd9d7d0, 0x33363b, 0xd2a021, 0x4f7d5a];
    for (k, block) in blocks().enumerate() {
        let car = Car::new(kit, paint, shapes[k % 3], tones[k], wheel);
        let half = DVec2::splat(BLOCK_M / 2.0 + 3.2);
        let track = Arc::new(Track::rectangle(block, half, 5.0, false));
        let lap = track.length_m();
        for start in [0.0, 0.47].into_iter().take(1 + k % 2) {
            let (track, start) = (Arc::clone(&track), start * lap + f64::from(rng.range(0.0, 20.0)));
            // Whole laps in a period, at some 8 m/s.
            let way = (8.0 * PERIOD_S / lap).round() * lap;
            car.drive(
                kit,
                &(Arc::new(move |share: f64| (track.pose(start + share * way, 0.0, 1.3), share * rolled_m(way))) as _),
            );
        }
        if k % 3 == 1 {
            continue;
        }
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let parked = dvec3(block.x + 5.0 - 3.0 * k as f64, 0.0, block.y + side * (BLOCK_M / 2.0 + 1.2));
        let place = DAffine3::from_translation(parked) * DAffine3::from_rotation_y(side * FRAC_PI_2);
        car.drive(kit, &(Arc::new(move |_: f64| (place, 0.0)) as _));
    }
}

/// People walk around the blocks on the pavement.
fn people(kit: &mut Kit) {
    let cloth = kit.painted("cloth");
    let figures = WARDROBE.map(|clothes| Figure::new(kit, cloth, clothes, [6, 2]));
    for (k, block) in blocks().enumerate() {
        let track = Arc::new(Track::rectangle(block, DVec2::splat(BLOCK_M / 2.0 - 1.4), 1.0, k % 2 == 0));
        let lap = track.length_m();
        for start in [0.1 + 0.09 * k as f64, 0.6 + 0.05 * k as f64].into_iter().take(1 + k % 2) {
            let track = Arc::clone(&track);
            let figure = figures[(k + (start * 10.0) as usize) % figures.len()];
            let strides = (lap / STRIDE_M).round();
            figure.walk(
                kit,
                &(Arc::new(move |share: f64| {
                    (track.pose((start + share) * lap, KERB_M, 0.25), strides * share + start * 7.0)
                }) as _),
            );
        }
    }
}

/// On the pavements between lamps and trees, and in the middle of streets.
pub(super) fn eyes() -> Vec<SceneCamera> {
    let mut eyes = Vec::new();
    for (k, block) in blocks().enumerate() {
        let pavement = BLOCK_M / 2.0 - 2.3;
        let y = KERB_M + EYE_HEIGHT_M;
        for (side, along) in [(1.0, -4.6), (-1.0, 5.4)] {
            let eye = dvec3(block.x + along, y, block.y + side * pavement);
            let slant = if k % 2 == 0 { 1.0 } else { -1.0 };
            eyes.push(camera(eye, dvec3(slant, 0.02, side * 0.45)));
        }
        let corner = dvec3(block.x + BLOCK_M / 2.0 - 0.7, y, block.y + BLOCK_M / 2.0 - 0.7);
        eyes.push(camera(corner, dvec3(-block.x.signum(), 0.03, -0.35 * block.y.signum())));
    }
    eyes
}
