//! A yard with 60 barrels: standing, stacked and rolling.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DAffine3, DQuat, dvec3, vec2, vec3};

use super::kit::Kit;
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;

const PERIOD_S: f64 = 16.0;
const RADIUS_M: f64 = 0.36;
const HEIGHT_M: f64 = 0.92;
const STANDING: usize = 36;
const STACKED: usize = 12;
const ROLLING: usize = 12;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(3.8, 3.0, 7.2), dvec3(-0.3, 0.2, 0.2));
    let paving = kit.textured("yard", texture::brick(0x9d958a, 0x77706a, [4, 8], 0.07));
    let mut yard = Mesher::new();
    yard.uv_per_m(0.4).cuboid_cells(vec3(-6.4, -0.2, -4.5), vec3(6.4, 0.0, 4.8), [12, 1, 9]);
    let yard = kit.mesh(yard, paving);
    kit.place("yard", yard, DAffine3::IDENTITY);
    let staves = kit.textured("staves", texture::planks(0xffffff, 8));
    let barrel = barrel(&mut kit, staves);
    let tones = [0xa9783f, 0x8d5f33, 0x5d7f92, 0x9c4a38];

    let mut rng = Rng::new(60);
    for k in 0..STANDING + STACKED {
        let layer = k / STANDING;
        let (i, j) = if layer == 0 { (k % 9, k / 9) } else { ((k - STANDING) * 3 % 8, (k - STANDING) / 4) };
        let shift = layer as f64 * 0.45;
        let x = (i as f64 - 4.0) * 0.92 + shift + f64::from(rng.range(-0.06, 0.06));
        let z = (j as f64 - 3.2) * 0.92 + shift + f64::from(rng.range(-0.06, 0.06));
        let at = dvec3(x, layer as f64 * HEIGHT_M, z);
        let (start, turns) = (f64::from(rng.unit()), if k % 4 == 0 { 1.0 } else { 0.0 });
        let tone = tones[rng.index(tones.len())];
        kit.drive("barrel", barrel, move |share| {
            DAffine3::from_rotation_translation(DQuat::from_rotation_y(TAU * (start + turns * share)), at)
        });
        kit.tint(tone);
    }
    for k in 0..ROLLING {
        let x = (k as f64 - (ROLLING as f64 - 1.0) / 2.0) * 0.8;
        let phase = f64::from(rng.unit());
        let middle = 2.3 + 0.5 * (k % 3) as f64;
        kit.drive("rolling barrel", barrel, move |share| {
            let gone = 1.0 * (TAU * (2.0 * share + phase)).sin();
            let lying = DQuat::from_rotation_x(gone / RADIUS_M) * DQuat::from_rotation_z(FRAC_PI_2);
            let centred = DAffine3::from_translation(dvec3(0.0, -HEIGHT_M / 2.0, 0.0));
            DAffine3::from_rotation_translation(lying, dvec3(x * 1.22, RADIUS_M, middle + gone)) * centred
        });
        kit.tint(tones[k % tones.len()]);
    }
    kit
}

/// White, for every barrel has a tone of its own.
fn barrel(kit: &mut Kit, staves: u32) -> u32 {
    let (radius, height) = (RADIUS_M as f32, HEIGHT_M as f32);
    let side = |t: f32| vec2(radius * (0.80 + 0.16 * (t * std::f32::consts::PI).sin()), t * height);
    let mut mesher = Mesher::new();
    let mut profile = vec![vec2(0.0, 0.04), vec2(radius * 0.74, 0.04), vec2(radius * 0.74, 0.0)];
    profile.extend((0..=10).map(|k| side(k as f32 / 10.0)));
    profile.extend([vec2(radius * 0.74, height), vec2(radius * 0.74, height - 0.04), vec2(0.0, height - 0.04)]);
    mesher.paint(0xffffff).uv_per_m(1.0).lathe(&profile, 18, 2.0);
    mesher.paint(0x4a4a4e);
    for t in [0.08f32, 0.30, 0.70, 0.92] {
        let (a, b) = (side(t - 0.03), side(t + 0.03));
        let out = vec2(0.008, 0.0);
        mesher.lathe(&[a, a + out, b + out, b], 18, 1.0);
    }
    kit.mesh(mesher, staves)
}
