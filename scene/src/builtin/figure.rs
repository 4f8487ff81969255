//! People made of rods: ten limbs that swing as they walk.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, Vec3, dvec3, vec3};

use super::kit::Kit;
use super::mesher::Mesher;

/// Metres of a full step cycle, left and right.
pub(super) const STRIDE_M: f64 = 1.35;
const HIP_M: f64 = 0.92;
const THIGH_M: f64 = 0.42;
const SHOULDER_M: f64 = 1.43;
const UPPER_ARM_M: f64 = 0.28;

/// What someone wears, sRGB.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clothes {
    pub shirt: u32,
    pub trousers: u32,
    pub skin: u32,
    pub hair: u32,
}

/// Some clothes to pick from.
pub(super) const WARDROBE: [Clothes; 4] = [
    Clothes { shirt: 0xb23a3a, trousers: 0x2f3b57, skin: 0xd9a27e, hair: 0x3a2a1e },
    Clothes { shirt: 0xe0d6c0, trousers: 0x5a4a3a, skin: 0x8d5a3c, hair: 0x17120e },
    Clothes { shirt: 0x3f7a5c, trousers: 0x3a3a40, skin: 0xe8bd9a, hair: 0xa0763a },
    Clothes { shirt: 0x3c62a8, trousers: 0x8a7f6a, skin: 0xc58a62, hair: 0x6a6460 },
];

/// The six meshes of someone; left and right share theirs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Figure {
    torso: u32,
    head: u32,
    upper_arm: u32,
    forearm: u32,
    thigh: u32,
    shin: u32,
}

/// Where someone stands and how far through a step cycle they are, after a share of the scene's period.
pub(super) type Walk = Arc<dyn Fn(f64) -> (DAffine3, f64) + Send + Sync>;

impl Figure {
    /// Makes the meshes; `detail` is (sides, rings of each round end).
    pub fn new(kit: &mut Kit, material: u32, clothes: Clothes, detail: [usize; 2]) -> Self {
        let mut rod = |parts: &[(u32, [Vec3; 2], [f32; 2])]| {
            let mut mesher = Mesher::new();
            for &(tone, ends, radii) in parts {
                mesher.paint(tone).capsule(ends, radii, detail);
            }
            kit.mesh(mesher, material)
        };
        let Clothes { shirt, trousers, skin, hair } = clothes;
        let down = |length: f32| [Vec3::ZERO, vec3(0.0, -length, 0.0)];
        let shoe = (0x2a2420, [vec3(0.0, -0.43, -0.04), vec3(0.0, -0.435, 0.14)], [0.055, 0.045]);
        Figure {
            torso: rod(&[
                (trousers, [vec3(-0.07, 0.0, 0.0), vec3(0.07, 0.0, 0.0)], [0.125; 2]),
                (shirt, [vec3(0.0, 0.05, 0.0), vec3(0.0, 0.40, 0.0)], [0.135, 0.165]),
            ]),
            head: rod(&[
                (skin, [vec3(0.0, 0.0, 0.0), vec3(0.0, 0.12, 0.0)], [0.055, 0.055]),
                (skin, [vec3(0.0, 0.15, 0.015), vec3(0.0, 0.20, 0.015)], [0.085, 0.095]),
                (hair, [vec3(0.0, 0.19, -0.02), vec3(0.0, 0.225, -0.015)], [0.098, 0.098]),
            ]),
            upper_arm: rod(&[(shirt, down(UPPER_ARM_M as f32), [0.06, 0.048])]),
            forearm: rod(&[
                (skin, down(0.25), [0.046, 0.034]),
                (skin, [vec3(0.0, -0.27, 0.0), vec3(0.0, -0.33, 0.01)], [0.042, 0.035]),
            ]),
            thigh: rod(&[(trousers, down(THIGH_M as f32), [0.092, 0.065])]),
            shin: rod(&[(trousers, down(0.40), [0.066, 0.045]), shoe]),
        }
    }

    /// Places someone who walks.
    pub fn walk(&self, kit: &mut Kit, walk: &Walk) {
        let mut limb = |name: &str, mesh: u32, pose: fn(f64) -> DAffine3, side: f64| {
            let walk = Arc::clone(walk);
            kit.drive(name, mesh, move |share| {
                let (world_from_figure, cycle) = walk(share);
                // The other side does the same half a cycle later, mirrored.
                let cycle = if side < 0.0 { cycle + 0.5 } else { cycle };
                let mut figure_from_limb = pose(cycle);
                figure_from_limb.translation.x *= side;
                world_from_figure * figure_from_limb
            });
        };
        limb("torso", self.torso, torso, 1.0);
        limb("head", self.head, |cycle| torso(cycle) * DAffine3::from_translation(DVec3::Y * 0.56), 1.0);
        for side in [-1.0, 1.0] {
            limb("upper arm", self.upper_arm, upper_arm, side);
            limb("forearm", self.forearm, forearm, side);
            limb("thigh", self.thigh, thigh, side);
            limb("shin", self.shin, shin, side);
        }
    }
}

fn swing(cycle: f64, ahead: f64) -> f64 {
    (TAU * (cycle + ahead)).sin()
}

fn joint(at: DVec3, pitch_rad: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_x(pitch_rad), at)
}

/// Rises over the standing leg, twice a cycle.
fn bob(cycle: f64) -> f64 {
    0.018 * (2.0 * TAU * cycle).cos()
}

fn torso(cycle: f64) -> DAffine3 {
    joint(dvec3(0.0, HIP_M + bob(cycle), 0.0), 0.04)
}

fn thigh(cycle: f64) -> DAffine3 {
    joint(dvec3(0.09, HIP_M + bob(cycle), 0.0), -0.05 - 0.46 * swing(cycle, 0.0))
}

fn shin(cycle: f64) -> DAffine3 {
    let bent = 0.42 * (1.0 + swing(cycle, 0.18)).powi(2) / 2.0;
    thigh(cycle) * joint(dvec3(0.0, -THIGH_M, 0.0), bent)
}

fn upper_arm(cycle: f64) -> DAffine3 {
    joint(dvec3(0.215, SHOULDER_M - 0.02 + bob(cycle), 0.0), 0.08 + 0.40 * swing(cycle, 0.0))
}

fn forearm(cycle: f64) -> DAffine3 {
    upper_arm(cycle) * joint(dvec3(0.0, -UPPER_ARM_M, 0.0), -0.35 + 0.2 * swing(cycle, 0.0))
}
