//! Rough mirrors: what a lobe mirrors of what is near, where it can be summed by itself.

use std::f64::consts::TAU;
use std::sync::Arc;

use protocol::sky::SkyLevel;
use protocol::{Sky, Tone};

use super::*;

const WHITE: [u8; 4] = [255, 255, 255, UNLIT];
const BLACK: [u8; 4] = [0, 0, 0, UNLIT];
/// Of the sky, in every direction.
const SKY: f32 = 0.5;

/// The wall as a white metal of a roughness, under an even sky, shown as light is.
fn held_rough(roughness: f32) -> Held {
    let mut held = held(MIRROR, 1.5);
    held.materials[usize::from(MIRROR)] = Material { metallic: 1.0, roughness, ..Material::default() };
    held.lighting = Some(Lighting { sky: SKY, tone: Tone::Cut, ..Lighting::default() });
    let mut diffuse = [[0.0; 3]; Sky::HARMONICS];
    diffuse[0] = [1.0 / 0.282_095; 3];
    let one = 0x3c00;
    let level = |number: usize| SkyLevel { texels: vec![[one; 3]; Sky::side_px(number) * Sky::side_px(number)] };
    held.sky = Some(Arc::new(Sky { diffuse, first_level: 0, levels: (0..Sky::LEVELS).map(level).collect() }));
    held
}

fn linear(code: u8) -> f64 {
    let c = f64::from(code) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The mean of a column of the picture, linear.
fn column(shown: &Shown, x: u32) -> f64 {
    (0..SIDE).map(|y| linear(shown.at(x, y)[1])).sum::<f64>() / f64::from(SIDE)
}

/// Of what the lobe of a pixel of the wall mirrors, the share that goes to the side of `edge_m` where x is greater, on a plane `away_m` before the wall:
/// summed over the facets of a GGX surface (Walter and others, 2007) by their area, as much as each is seen.
fn share_beyond(roughness: f64, (x, y): (u32, u32), away_m: f64, edge_m: f64) -> f64 {
    let alpha = roughness * roughness;
    let to_eye = -way(x, y).normalize();
    let at = way(x, y) * WALL_M;
    let lambda = |cosine: f64| {
        let squared = cosine * cosine;
        0.5 * ((1.0 + alpha * alpha * (1.0 - squared) / squared).sqrt() - 1.0)
    };
    let (mut beyond, mut all) = (0.0, 0.0);
    let steps = 200;
    for across in 0..steps {
        for around in 0..steps {
            // Evenly by the area of facets that D describes.
            let (u, turn) =
                ((f64::from(across) + 0.5) / f64::from(steps), TAU * (f64::from(around) + 0.5) / f64::from(steps));
            let cosine = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
            let sine = (1.0 - cosine * cosine).sqrt();
            let facet = DVec3::new(sine * turn.cos(), sine * turn.sin(), cosine);
            let seen = to_eye.dot(facet);
            let light = facet * (2.0 * seen) - to_eye;
            if seen <= 0.0 || light.z <= 0.0 {
                continue;
            }
            let weight = seen / cosine / (1.0 + lambda(to_eye.z) + lambda(light.z));
            let met = at + light * (away_m / light.z);
            all += weight;
            beyond += if met.x > edge_m { weight } else { 0.0 };
        }
    }
    beyond / all
}

#[test]
fn a_rough_mirror_blurs_an_edge_as_its_lobe_says() {
    for roughness in [0.2_f32, 0.35, 0.5] {
        let half = |x: f64, _: f64| Some(if x > 0.3 { WHITE } else { BLACK });
        let near = plane(pinhole(DVec3::new(0.3, 0.0, -3.5), DVec3::Z, 512), ImpostorKind::Environment, -0.5, half);
        let shown = show(&held_rough(roughness), &[near], Settings::default());
        let mut worst: f64 = 0.0;
        for x in (2..SIDE - 2).step_by(4) {
            let expected = (0..8).map(|k| share_beyond(roughness.into(), (x, k * 8 + 4), 1.5, 0.3)).sum::<f64>() / 8.0;

            worst = worst.max((column(&shown, x) - expected).abs());
        }
        println!("roughness {roughness}: {worst:.3} off at most");
        // Sixteen rays tell a share in steps of a sixteenth, and two may lie along one edge.
        assert!(worst < 0.125, "{worst} off at roughness {roughness}");
    }
}

#[test]
fn where_nothing_is_near_it_shows_the_sky_as_without_rays() {
    let nothing = plane(pinhole(DVec3::ZERO, DVec3::Z, 64), ImpostorKind::Object(9), 3.0, |_, _| None);
    let beside =
        plane(pinhole(DVec3::ZERO, DVec3::Z, 64), ImpostorKind::Object(9), 3.0, |x, _| (x > 2.9).then_some(BLACK));
    for roughness in [0.2_f32, 0.5] {
        let [by_rays, by_sky] =
            [beside.clone(), nothing.clone()].map(|image| show(&held_rough(roughness), &[image], Settings::default()));
        assert!(by_rays.reflects && !by_sky.reflects);
        let apart = (0..SIDE).map(|y| by_rays.at(0, y)[1].abs_diff(by_sky.at(0, y)[1])).max();
        assert!(apart <= Some(2), "{apart:?} codes at roughness {roughness}");
    }
}

#[test]
fn the_plain_look_has_no_rough_mirrors() {
    let mut held = held_rough(0.3);
    held.sky = None;
    held.lighting = Some(Lighting { ambient: [0.5; 3], ..Lighting::default() });
    let white = plane(pinhole(DVec3::ZERO, DVec3::Z, 64), ImpostorKind::Environment, 3.0, |_, _| Some(WHITE));
    let [beside, alone] = [vec![white], Vec::new()].map(|images| show(&held, &images, Settings::default()).pixels);
    assert!(beside == alone);
}
