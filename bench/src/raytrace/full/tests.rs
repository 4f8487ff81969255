//! Integrals whose answer is known.

use std::f64::consts::PI;

use super::lobes::{self, Albedo, Pair};
use super::*;

fn white() -> Environment {
    Environment { width_px: 4, height_px: 2, radiance: vec![[1.0; 3]; 8] }
}

fn surface(metallic: f64, roughness: f64) -> Shaded {
    Shaded {
        base: DVec3::ONE,
        metallic,
        roughness,
        occlusion: 1.0,
        emissive: DVec3::ZERO,
        straight: DVec3::splat(0.04),
        grazing: 1.0,
        coat: 0.0,
        coat_roughness: 0.0,
        sheen: DVec3::ZERO,
        sheen_roughness: 0.5,
        passing: 0.0,
    }
}

#[test]
fn a_white_metal_in_a_white_room_is_white() {
    let sky = FullSky::new(&white(), 1.0);
    for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
        for tilt in [0.0_f64, 0.5, 1.0, 1.4] {
            let to_eye = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            let light = sky.leaving(&surface(1.0, roughness), DVec3::Z, to_eye, Around::Sky);
            // What several facets send back makes up for what one loses.
            assert!((light - DVec3::ONE).abs().max_element() < 0.02, "{light} at roughness {roughness}, {tilt} rad");
        }
    }
}

#[test]
fn a_black_dielectric_mirrors_as_fresnel_says() {
    let sky = FullSky::new(&white(), 1.0);
    let black = Shaded { base: DVec3::ZERO, ..surface(0.0, 0.0) };
    for tilt in [0.0_f64, 0.7, 1.2] {
        let light = sky.leaving(&black, DVec3::Y, DVec3::new(tilt.sin(), tilt.cos(), 0.0), Around::Sky);
        let wanted = 0.04 + 0.96 * (1.0 - tilt.cos()).powi(5);
        assert!((light.x - wanted).abs() < 1e-6, "{light} for {wanted}");
    }
}

#[test]
fn directions_are_drawn_as_the_lobe_says() {
    // The lobe, summed over even directions, and over its own.
    let albedo = Albedo::new();
    for roughness in [0.3, 0.6, 0.95] {
        for cosine in [0.2_f64, 0.6, 0.95] {
            let eye = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            const EVEN: u32 = 1 << 16;
            let of = |index: u32| {
                let point = hammersley(index, EVEN);
                let turn = 2.0 * PI * point.y;
                let sine = (1.0 - point.x * point.x).sqrt();
                let light = DVec3::new(sine * turn.cos(), sine * turn.sin(), point.x);
                lobes::ggx(roughness, &Pair::new(eye, light)) * 2.0 * PI
            };
            let even = (0..EVEN).map(of).sum::<f64>() / f64::from(EVEN);
            let drawn = albedo.facets(roughness, cosine);
            assert!((even - drawn).abs() < 0.006, "{even} and {drawn} at {roughness}, {cosine}");
        }
    }
}

#[test]
fn a_lamp_and_a_small_patch_of_sky_are_one() {
    // A patch of two by two degrees, as bright as to bring an irradiance of 1.
    let (width_px, height_px) = (180, 90);
    let mut environment = Environment { width_px, height_px, radiance: vec![[0.0; 3]; 180 * 90] };
    let [x, y] = [40, 30];
    let to_light = scene::environment::direction_from_uv(DVec2::new(
        (f64::from(x) + 0.5) / f64::from(width_px),
        1.0 - (f64::from(y) + 0.5) / f64::from(height_px),
    ));
    environment.radiance[(y * width_px + x) as usize] = [1.0; 3];
    let solid = environment.mean_radiance().x as f64 * 4.0 * PI;
    let normal = (to_light + DVec3::new(0.2, 0.3, -0.1)).normalize();
    let to_eye = (to_light + DVec3::new(0.5, 0.4, 0.3)).normalize();
    let mut sky = FullSky::new(&environment, 1.0 / solid);
    sky.points = (0..1 << 18).map(|index| hammersley(index, 1 << 18)).collect();
    for (metallic, roughness) in [(0.0, 0.6), (1.0, 0.7), (0.5, 1.0)] {
        let mut surface = surface(metallic, roughness);
        surface.base = DVec3::new(0.7, 0.4, 0.2);
        surface.sheen = DVec3::new(0.1, 0.2, 0.3);
        surface.coat = 0.5;
        surface.coat_roughness = 0.5;
        let (of_sky, of_lamp) =
            (sky.leaving(&surface, normal, to_eye, Around::Sky), sky.of_lamp(&surface, normal, to_eye, to_light));
        let off = ((of_sky - of_lamp) / of_lamp).abs().max_element();
        assert!(off < 0.03, "{of_sky} of the sky, {of_lamp} of the lamp");
    }
}
