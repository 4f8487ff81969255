//! A bird's nest: a bowl of some five hundred curved twigs with three eggs and a bird beside it, as the thin, layered
//! geometry of Xie, Wang, Popescu 2016 (section 6).

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, DAffine3, DQuat, Quat, Vec3, dvec3, vec3};

use super::kit::Kit;
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;

const RADIUS_M: f32 = 0.5;
const TWIGS: usize = 496;
/// Objects that share the twigs: each is spread over the whole bowl.
const BUNDLES: usize = 16;
const TWIG_POINTS: usize = 13;
const TWIG_SIDES: usize = 5;
const PERIOD_S: f64 = 16.0;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    let bark = kit.textured("twig bark", texture::bark(0xfffaf2));
    let mut rng = Rng::new(67);
    for _ in 0..BUNDLES {
        let mut bundle = Mesher::new();
        for _ in 0..TWIGS / BUNDLES {
            twig(&mut bundle, &mut rng);
        }
        let mesh = kit.mesh(bundle, bark);
        kit.drive("twigs", mesh, turning);
    }
    eggs(&mut kit);
    kit.look(dvec3(0.12, 0.48, 0.52), dvec3(0.0, -0.12, 0.0));
    kit
}

/// The nest turns once in a period, so that every side comes into view.
fn turning(share: f64) -> DAffine3 {
    DAffine3::from_rotation_y(share * std::f64::consts::TAU)
}

/// A twig winds around the bowl: it climbs and falls between the bottom and the rim while it goes around.
fn twig(mesher: &mut Mesher, rng: &mut Rng) {
    let start = rng.unit() * TAU;
    let sweep = rng.range(0.7, 1.9) * if rng.unit() < 0.5 { 1.0 } else { -1.0 };
    // Angle from the bottom; more twigs towards the rim, where the circle is longer.
    let rim = 1.72;
    let middle = rim * (0.12 + 0.88 * rng.unit().powf(0.62));
    let climb = rng.range(-0.45, 0.45);
    let layer = RADIUS_M * rng.range(0.80, 0.98);
    let bow = rng.range(-0.03, 0.05) * RADIUS_M;
    let wobble = rng.unit() * TAU;
    let spine: Vec<Vec3> = (0..TWIG_POINTS)
        .map(|k| {
            let t = k as f32 / (TWIG_POINTS - 1) as f32;
            let around = start + sweep * t;
            let from_bottom = (middle + climb * (t - 0.5) + 0.05 * (wobble + 5.0 * t).sin()).clamp(0.05, rim + 0.12);
            let radius = layer + bow * (PI * t).sin() + 0.012 * RADIUS_M * (wobble * 3.0 + 9.0 * t).sin();
            let (out, down) = from_bottom.sin_cos();
            vec3(radius * out * around.cos(), -0.72 * radius * down, radius * out * around.sin())
        })
        .collect();
    let thick = RADIUS_M * rng.range(0.011, 0.021);
    let radii: Vec<f32> = (0..TWIG_POINTS).map(|k| thick * (1.0 - 0.55 * k as f32 / TWIG_POINTS as f32)).collect();
    let tones = [0x8a6a48, 0x745437, 0xa3835a, 0x5f4a35, 0x9b8a6b, 0x6e5b45, 0xb59a6a, 0x7d6d4a];
    mesher.paint(rng.pick(&tones)).uv_per_m(6.0).tube(&spine, &radii, TWIG_SIDES);
}

fn eggs(kit: &mut Kit) {
    let shell = kit.textured("egg shell", texture::mottled(0xa9cfc9, 24, 0.14));
    let mut mesher = Mesher::new();
    mesher.ellipsoid(vec3(0.085, 0.115, 0.085), [24, 16]);
    let egg = kit.mesh(mesher, shell);
    for (k, (x, z)) in [(0.10, 0.03), (-0.07, 0.09), (-0.02, -0.10)].into_iter().enumerate() {
        let lean = DQuat::from_rotation_y(k as f64 * 2.1) * DQuat::from_rotation_z(1.2 + 0.2 * k as f64);
        kit.drive("egg", egg, move |share| {
            let rock = DQuat::from_rotation_x(0.12 * (std::f64::consts::TAU * (4.0 * share + k as f64 / 3.0)).sin());
            turning(share) * DAffine3::from_rotation_translation(rock * lean, dvec3(x, -0.185, z))
        });
    }
    let down = kit.painted("down");
    let mut mesher = Mesher::new();
    // The felted lining that carries the eggs.
    mesher.paint(0x6f6048).frame(Affine3A::from_rotation_translation(Quat::IDENTITY, vec3(0.0, -0.30, 0.0)));
    mesher.ellipsoid(vec3(0.27, 0.05, 0.27), [24, 8]);
    let lining = kit.mesh(mesher, down);
    kit.drive("lining", lining, turning);
}
