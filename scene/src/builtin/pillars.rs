//! A closed hall of 24 x 24 x 4 m with 25 columns and 36 crates.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3, dvec3, vec2, vec3};

use super::kit::{EYE_HEIGHT_M, Kit, camera};
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;
use crate::model::SceneCamera;

const HALF_M: f32 = 12.0;
const HEIGHT_M: f32 = 4.0;
const WALL_M: f32 = 0.3;
const COLUMN_PITCH_M: f64 = 4.0;
const PERIOD_S: f64 = 24.0;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.walk = true;
    kit.look(dvec3(-4.0, EYE_HEIGHT_M, 10.0), dvec3(6.5, 1.2, -4.0));
    kit.light(dvec3(-0.5, -0.7, -0.5), [1.05, 0.98, 0.88]);
    kit.light(dvec3(0.7, -0.3, 0.45), [0.55, 0.60, 0.70]);
    kit.light(dvec3(0.1, 0.9, -0.4), [0.60, 0.55, 0.48]);
    kit.light(dvec3(0.3, 0.1, -0.9), [0.30, 0.30, 0.32]);
    hall(&mut kit);
    columns(&mut kit);
    crates(&mut kit);
    kit
}

fn hall(kit: &mut Kit) {
    let floor = kit.textured("floor tiles", texture::tiles([0xb9ac97, 0x8f7f6c], 0x6b6258, 4));
    let ceiling = kit.textured("ceiling", texture::mottled(0xd9d2c4, 8, 0.05));
    let brick = kit.textured("wall bricks", texture::brick(0xa9684d, 0xc9bda9, [4, 8], 0.08));
    let plaster = kit.textured("plaster", texture::mottled(0x8fa3a0, 6, 0.07));
    let outer = HALF_M + WALL_M;
    let mut slab = |name: &str, material: u32, min: Vec3, max: Vec3, cells: [usize; 3], uv_per_m: f32| {
        let mut mesher = Mesher::new();
        mesher.uv_per_m(uv_per_m).cuboid_cells(min, max, cells);
        let mesh = kit.mesh(mesher, material);
        kit.place(name, mesh, DAffine3::IDENTITY);
    };
    slab("floor", floor, vec3(-outer, -WALL_M, -outer), vec3(outer, 0.0, outer), [16, 1, 16], 0.4);
    slab("ceiling", ceiling, vec3(-outer, HEIGHT_M, -outer), vec3(outer, HEIGHT_M + WALL_M, outer), [12, 1, 12], 0.3);
    for (name, side, material) in [("west wall", -1.0, brick), ("east wall", 1.0, plaster)] {
        let (a, b): (f32, f32) = (side * HALF_M, side * outer);
        slab(name, material, vec3(a.min(b), 0.0, -outer), vec3(a.max(b), HEIGHT_M, outer), [1, 3, 16], 0.5);
    }
    for (name, side, material) in [("north wall", -1.0, plaster), ("south wall", 1.0, brick)] {
        let (a, b): (f32, f32) = (side * HALF_M, side * outer);
        slab(name, material, vec3(-HALF_M, 0.0, a.min(b)), vec3(HALF_M, HEIGHT_M, a.max(b)), [16, 3, 1], 0.5);
    }
}

/// Plinth, base, swelling shaft, capital.
fn column_profile() -> Vec<Vec2> {
    let mut profile = vec![vec2(0.0, 0.0), vec2(0.46, 0.0), vec2(0.46, 0.16), vec2(0.40, 0.16)];
    let torus = |k: usize| {
        let angle = k as f32 / 4.0 * std::f32::consts::PI;
        vec2(0.36 + 0.05 * angle.sin(), 0.19 - 0.05 * angle.cos())
    };
    profile.extend((1..=4).map(torus));
    profile.extend((0..=5).map(|k| {
        let y = k as f32 / 5.0;
        vec2(0.33 - 0.06 * y * y, 0.30 + 3.2 * y)
    }));
    profile.extend([vec2(0.32, 3.54), vec2(0.32, 3.6), vec2(0.29, 3.64), vec2(0.46, 3.84), vec2(0.46, HEIGHT_M)]);
    profile.push(vec2(0.0, HEIGHT_M));
    profile
}

fn columns(kit: &mut Kit) {
    let tones = [(0xded6c6, 0x9c8f7d), (0xa8b5a4, 0x5f7363), (0xc9a493, 0x8a5a4c)];
    let meshes = tones.map(|(tone, vein)| {
        let marble = kit.textured("marble", texture::marble(tone, vein));
        let mut mesher = Mesher::new();
        mesher.uv_per_m(0.5).lathe(&column_profile(), 32, 1.0);
        kit.mesh(mesher, marble)
    });
    for (i, j) in (-2..=2).flat_map(|i| (-2..=2).map(move |j| (i, j))) {
        let mesh = meshes[(i + 2 * j + 8) as usize % 3];
        let at = dvec3(f64::from(i), 0.0, f64::from(j)) * COLUMN_PITCH_M;
        kit.place("column", mesh, DAffine3::from_translation(at));
    }
}

/// One crate in the middle of each of the 6 x 6 bays; every third one rises and sinks, others slide along their aisle.
fn crates(kit: &mut Kit) {
    let mut rng = Rng::new(36);
    let sizes = [0.7f32, 0.9, 1.2];
    let meshes = [(0xb08850, 0), (0x96713f, 1), (0x8a9a5a, 2), (0x5f86a8, 0), (0xb5563f, 1), (0xc9a24e, 2)].map(
        |(tone, size)| {
            let wood = kit.textured("crate", texture::crate_side(tone));
            let (half, height) = (sizes[size] / 2.0, sizes[size]);
            let mut mesher = Mesher::new();
            mesher.uv_per_m(1.0 / height);
            mesher.cuboid_cells(vec3(-half, 0.0, -half), vec3(half, height, half), [4, 4, 4]);
            kit.mesh(mesher, wood)
        },
    );
    for index in 0..36 {
        let (i, j) = (f64::from(index % 6) - 2.5, f64::from(index / 6) - 2.5);
        let yaw = DQuat::from_rotation_y(f64::from(rng.range(-0.5, 0.5)));
        let near = f64::from(rng.range(-0.1, 0.1));
        let at = dvec3(i, 0.0, j) * COLUMN_PITCH_M + dvec3(near, 0.0, -near);
        let (laps, phase) = (f64::from(1 + index % 3), f64::from(rng.unit()) * TAU);
        let kind = index % 3;
        kit.drive("crate", meshes[rng.index(meshes.len())], move |share| {
            let swing = (TAU * laps * share + phase).sin();
            let shift = match kind {
                0 => DVec3::Y * (0.6 + 0.6 * swing),
                1 => DVec3::X * 0.35 * swing,
                _ => DVec3::Z * 0.35 * swing,
            };
            DAffine3::from_rotation_translation(yaw, at + shift)
        });
    }
}

/// Between columns, half way along the aisles' crossings.
pub(super) fn eyes() -> Vec<SceneCamera> {
    let at = |x: f64, z: f64| {
        camera(dvec3(x * COLUMN_PITCH_M, EYE_HEIGHT_M, z * COLUMN_PITCH_M), dvec3(-x - 0.35 * z, -0.04, -z + 0.35 * x))
    };
    [-1.0, 0.0, 1.0].iter().flat_map(|&x| [-1.5, -0.5, 0.5, 1.5].iter().map(move |&z| at(x, z))).collect()
}
