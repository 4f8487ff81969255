//! A calm lake among hills: a large flat mirror, with trees on its shore, a pier, and a boat.

use std::f64::consts::TAU;

use camera::Trace;
use glam::{DAffine3, dvec3, vec2, vec3};

use super::kit::{Kit, path as path_of};
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;
use crate::model::Material;

const PERIOD_S: f64 = 24.0;
/// Half a side of the water, which ends under its shore.
const HALF_WATER_M: f32 = 32.0;
const TREES: usize = 48;
const HILLS: usize = 9;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.0, 2.2, 20.0), dvec3(0.0, 0.6, 0.0));
    water(&mut kit);
    shore(&mut kit);
    trees(&mut kit);
    pier(&mut kit);
    boat(&mut kit);
    kit
}

fn water(kit: &mut Kit) {
    let base_colour = [0.72, 0.8, 0.82, 1.0];
    let calm =
        Material { name: "water mirror".into(), metallic: 1.0, roughness: 0.0, base_colour, ..Material::default() };
    let calm = kit.material(calm);
    let side = 2.0 * HALF_WATER_M;
    let mut water = Mesher::new();
    water.panel(vec3(-HALF_WATER_M, 0.0, HALF_WATER_M), vec3(side, 0.0, 0.0), vec3(0.0, 0.0, -side), [16, 16]);
    let water = kit.mesh(water, calm);
    kit.place("lake mirror", water, DAffine3::IDENTITY);
}

/// A meadow that rises from the water, and hills behind it.
fn shore(kit: &mut Kit) {
    let lawn = kit.textured("lawn", texture::mottled(0x74893f, 12, 0.20));
    let mut meadow = Mesher::new();
    let slope = [(72.0, 7.0), (50.0, 3.0), (34.0, 0.6), (28.0, -0.5)];
    meadow.uv_per_m(0.1).lathe(&slope.map(|(r, y)| vec2(r, y)), 64, 40.0);
    let meadow = kit.mesh(meadow, lawn);
    kit.place("meadow", meadow, DAffine3::IDENTITY);
    let tones = [0x5f7a45, 0x7c8a5a, 0x8b8068];
    let rock = kit.textured("hillside", texture::mottled(0xffffff, 10, 0.25));
    for k in 0..HILLS {
        let height_m = 9.0 + 4.0 * ((k * 4) % 5) as f32;
        let profile = [(20.0, 0.0), (14.0, 0.4), (8.0, 0.75), (3.0, 0.95), (0.0, 1.0)];
        let mut hill = Mesher::new();
        hill.paint(tones[k % tones.len()]).uv_per_m(0.08);
        hill.lathe(&profile.map(|(r, share)| vec2(r, share * height_m)), 32, 8.0);
        let hill = kit.mesh(hill, rock);
        let angle = TAU * k as f64 / HILLS as f64;
        kit.place("hill", hill, DAffine3::from_translation(dvec3(64.0 * angle.cos(), 2.0, 64.0 * angle.sin())));
    }
}

fn trees(kit: &mut Kit) {
    let bark = kit.textured("bark", texture::bark(0x8a7359));
    let leaves = kit.textured("leaves", texture::mottled(0xf2f4e6, 16, 0.3));
    let mut trunk = Mesher::new();
    trunk.tube(&[vec3(0.0, -0.5, 0.0), vec3(0.0, 2.2, 0.0)], &[0.28, 0.18], 12);
    let trunk = kit.mesh(trunk, bark);
    let crowns = [0x5d8433, 0x7fa544, 0xa8812f].map(|tone| {
        let mut crown = Mesher::new();
        crown.paint(tone).at(0.0, 3.6, 0.0).ellipsoid(vec3(1.5, 2.1, 1.5), [24, 12]);
        kit.mesh(crown, leaves)
    });
    let mut rng = Rng::new(48);
    for k in 0..TREES {
        let angle = TAU * (k as f64 + f64::from(rng.range(-0.3, 0.3))) / TREES as f64;
        let away_m = f64::from(rng.range(33.0, 42.0));
        let up_m = 0.5 + (away_m - 33.0) * 0.14;
        let place = DAffine3::from_translation(dvec3(away_m * angle.cos(), up_m, away_m * angle.sin()));
        kit.place("trunk", trunk, place);
        kit.place("crown", crowns[rng.index(crowns.len())], place);
    }
}

/// Planks on posts, from the left shore into the water.
fn pier(kit: &mut Kit) {
    let wood = kit.textured("planks", texture::planks(0xa87a4c, 6));
    let mut deck = Mesher::new();
    deck.uv_per_m(0.5).cuboid_cells(vec3(-32.0, 0.55, -0.9), vec3(-6.0, 0.7, 0.9), [13, 1, 1]);
    let deck = kit.mesh(deck, wood);
    let pier = DAffine3::from_translation(dvec3(0.0, 0.0, 2.0));
    kit.place("pier", deck, pier);
    let mut post = Mesher::new();
    post.uv_per_m(0.5).tube(&[vec3(0.0, 0.0, 0.0), vec3(0.0, 1.5, 0.0)], &[0.13, 0.12], 16);
    let post = kit.mesh(post, wood);
    for k in 0..14 {
        let (x, z) = (-6.3 - 3.6 * f64::from(k / 2), if k % 2 == 0 { -1.0 } else { 1.0 });
        kit.place("post", post, pier * DAffine3::from_translation(dvec3(x, 0.0, z)));
    }
}

/// Drifts around over the deep water.
fn boat(kit: &mut Kit) {
    let paint = kit.painted("boat paint");
    let mut hull = Mesher::new();
    hull.paint(0xb3262a).cuboid(vec3(-0.8, 0.0, -1.8), vec3(0.8, 0.5, 1.8));
    hull.paint(0xf0ead2).cuboid(vec3(-0.6, 0.5, -1.0), vec3(0.6, 1.3, 0.4));
    hull.paint(0x8f6a45).cuboid(vec3(-0.06, 1.3, -0.4), vec3(0.06, 4.2, -0.28));
    let hull = kit.mesh(hull, paint);
    kit.drive("boat", hull, |share| {
        let at = dvec3(5.0 + 3.0 * (TAU * share).cos(), 0.0, -4.0 + 3.0 * (TAU * share).sin());
        DAffine3::from_translation(at) * DAffine3::from_rotation_y(0.7 - TAU * share)
    });
}

/// Along the near shore, over the water.
pub(super) fn path() -> Trace {
    path_of(|share, _| (dvec3(-5.0 + 10.0 * share, 2.2, 18.0 - 4.0 * share), dvec3(0.0, 0.0, -2.0)))
}
