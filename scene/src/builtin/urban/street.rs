//! Roads, pavements and gardens, and what stands on them.

use glam::{DAffine3, DVec2, Vec3, dvec2, dvec3, vec3};

use super::ground::{BLOCK_M, BLOCKS, KERB_M, PAVEMENT_M, PITCH_M, STREET_M, blocks, outer, slab};
use crate::builtin::kit::Kit;
use crate::builtin::mesher::Mesher;
use crate::builtin::rng::Rng;
use crate::builtin::texture;

const ASPHALT: u32 = 0x5d5d60;
const CROSSING_M: f64 = 3.0;

pub(super) fn build(kit: &mut Kit) {
    let paving = kit.textured("paving", texture::tiles([0xb4ada0, 0xaaa396], 0x8b857a, 4));
    let lawn = kit.textured("lawn", texture::mottled(0x6d8a45, 10, 0.20));
    for block in blocks() {
        let half = DVec2::splat(BLOCK_M / 2.0);
        slab(kit, "pavement", paving, [block - half, block + half], KERB_M, 0.4);
        let garden = dvec2(BLOCK_M / 2.0 - PAVEMENT_M, BLOCK_M / 2.0 - PAVEMENT_M - 0.4);
        slab(kit, "garden", lawn, [block - garden, block + garden], KERB_M + 0.03, 0.25);
    }
    let (inner, beyond) = (outer(), outer() + DVec2::splat(PAVEMENT_M + 9.0));
    for side in [-1.0, 1.0] {
        let z = [side * inner.y, side * beyond.y];
        let rim = [dvec2(-beyond.x, z[0].min(z[1])), dvec2(beyond.x, z[0].max(z[1]))];
        slab(kit, "pavement", paving, rim, KERB_M, 0.4);
        let x = [side * inner.x, side * beyond.x];
        let rim = [dvec2(x[0].min(x[1]), -inner.y), dvec2(x[0].max(x[1]), inner.y)];
        slab(kit, "pavement", paving, rim, KERB_M, 0.4);
    }
    roads(kit);
}

/// Road pieces lie flush beside each other: lanes with lines, crossings at their ends, plain asphalt where they meet.
fn roads(kit: &mut Kit) {
    let lanes = kit.textured("road", texture::road(ASPHALT));
    let stripes = kit.textured("crossing", texture::crossing(ASPHALT));
    let plain = kit.textured("asphalt", texture::mottled(ASPHALT, 8, 0.10));
    let street = |k: usize, count: usize| (k as f64 - count as f64 / 2.0) * PITCH_M;
    let half = STREET_M / 2.0;
    let run = BLOCK_M - 2.0 * CROSSING_M;
    // Along z: a run of road from the crossing's far edge, in a frame with x across.
    let mut piece = |material: u32, centre: DVec2, yaw: f64, length: f64| {
        let mut mesher = Mesher::new();
        let (w, l) = (half as f32, length as f32);
        mesher.uv_per_m(1.0 / STREET_M as f32).panel(
            vec3(-w, 0.0, l / 2.0),
            Vec3::X * 2.0 * w,
            Vec3::NEG_Z * l,
            [1, 1],
        );
        let mesh = kit.mesh(mesher, material);
        let place = DAffine3::from_translation(dvec3(centre.x, 0.0, centre.y)) * DAffine3::from_rotation_y(yaw);
        kit.place("road", mesh, place);
    };
    let mut link = |centre: DVec2, yaw: f64| {
        let along = if yaw == 0.0 { DVec2::Y } else { DVec2::X };
        piece(lanes, centre, yaw, run);
        for side in [-1.0, 1.0] {
            piece(stripes, centre + along * side * (run + CROSSING_M) / 2.0, yaw, CROSSING_M);
        }
    };
    for i in 0..=BLOCKS[0] {
        for j in 0..BLOCKS[1] {
            link(dvec2(street(i, BLOCKS[0]), street(j, BLOCKS[1]) + PITCH_M / 2.0), 0.0);
        }
    }
    for j in 0..=BLOCKS[1] {
        for i in 0..BLOCKS[0] {
            link(dvec2(street(i, BLOCKS[0]) + PITCH_M / 2.0, street(j, BLOCKS[1])), std::f64::consts::FRAC_PI_2);
        }
    }
    for (i, j) in (0..=BLOCKS[0]).flat_map(|i| (0..=BLOCKS[1]).map(move |j| (i, j))) {
        piece(plain, dvec2(street(i, BLOCKS[0]), street(j, BLOCKS[1])), 0.0, STREET_M);
    }
}

/// Trees and lamps along the kerbs, trees and hedges in the gardens.
pub(super) fn furniture(kit: &mut Kit, rng: &mut Rng) {
    let painted = kit.painted("street furniture");
    let leaves = kit.textured("foliage", texture::mottled(0xf0f4e4, 14, 0.30));
    let lamp = lamp(kit, painted);
    let trunk = trunk(kit, painted);
    let crowns = [0x5f8a3a, 0x7d9a3f, 0x4f7a44].map(|tone| crown(kit, leaves, tone, rng));
    let hedge = hedge(kit, leaves);
    for block in blocks() {
        let mut plant = |kit: &mut Kit, x: f64, z: f64| {
            let place = DAffine3::from_translation(dvec3(block.x + x, KERB_M, block.y + z))
                * DAffine3::from_rotation_y(f64::from(rng.range(0.0, 6.0)));
            kit.place("trunk", trunk, place);
            kit.place("crown", crowns[rng.index(crowns.len())], place);
        };
        let kerb = BLOCK_M / 2.0 - 0.5;
        for (x, side) in [(-9.0, 1.0), (9.5, 1.0), (-8.0, -1.0)] {
            plant(kit, x, side * kerb);
        }
        plant(kit, -6.0, 0.8);
        for (x, z) in [(0.5, kerb), (0.5, -kerb), (kerb, 0.0), (-kerb, 0.0)] {
            kit.place("lamp", lamp, DAffine3::from_translation(dvec3(block.x + x, KERB_M, block.y + z)));
        }
        for side in [-1.0, 1.0] {
            kit.place("hedge", hedge, DAffine3::from_translation(dvec3(block.x + side * 14.2, KERB_M, block.y)));
        }
    }
}

fn lamp(kit: &mut Kit, material: u32) -> u32 {
    let mut mesher = Mesher::new();
    let post = [Vec3::ZERO, vec3(0.0, 0.8, 0.0), vec3(0.0, 4.2, 0.0)];
    mesher.paint(0x39403f).tube(&post, &[0.10, 0.06, 0.045], 6);
    mesher.at(0.0, 4.2, 0.0).cuboid(vec3(-0.2, 0.42, -0.2), vec3(0.2, 0.5, 0.2));
    mesher.paint(0xf2e8c4).cuboid(vec3(-0.14, 0.0, -0.14), vec3(0.14, 0.42, 0.14));
    kit.mesh(mesher, material)
}

fn trunk(kit: &mut Kit, material: u32) -> u32 {
    let mut mesher = Mesher::new();
    let spine = [vec3(0.0, -0.1, 0.0), vec3(0.03, 1.0, 0.0), vec3(0.0, 2.2, 0.05), vec3(0.05, 4.0, 0.0)];
    mesher.paint(0x6d5540).tube(&spine, &[0.20, 0.14, 0.12, 0.07], 6);
    kit.mesh(mesher, material)
}

fn crown(kit: &mut Kit, material: u32, tone: u32, rng: &mut Rng) -> u32 {
    let mut mesher = Mesher::new();
    mesher.paint(tone);
    for (x, y, z, r) in
        [(0.0, 4.3, 0.0, 1.35), (0.75, 3.5, 0.35, 0.95), (-0.6, 3.6, -0.45, 1.0), (-0.1, 3.4, 0.8, 0.85)]
    {
        mesher.at(x, y + rng.range(-0.15, 0.15), z);
        mesher.ellipsoid(vec3(r, r * rng.range(0.8, 1.0), r), [7, 5]);
    }
    kit.mesh(mesher, material)
}

fn hedge(kit: &mut Kit, material: u32) -> u32 {
    let mut mesher = Mesher::new();
    mesher.paint(0x55763a).uv_per_m(0.5).cuboid(vec3(-0.4, 0.0, -5.0), vec3(0.4, 1.25, 5.0));
    kit.mesh(mesher, material)
}
