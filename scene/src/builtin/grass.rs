//! A meadow: tufts of bent blades on uneven ground, with flowers; the wind goes through it.

use std::f32::consts::TAU;

use glam::{DAffine3, Vec3, dvec3, vec2, vec3};

use super::kit::{Kit, camera};
use super::mesher::{Mesher, Point};
use super::rng::Rng;
use super::texture;
use crate::model::{Material, SceneCamera, Vertex};

const HALF_M: f32 = 6.0;
/// Tufts a side of the field.
const TUFTS: usize = 12;
/// Of a tuft.
pub(super) const BLADES: usize = 36;
/// Pieces of a blade from root to tip.
const PIECES: usize = 5;
/// Different tufts; the field repeats them, turned.
const KINDS: usize = 6;
const PERIOD_S: f64 = 12.0;
/// A walker here is a child: the blades reach to the eyes' lower half.
const EYE_M: f64 = 1.1;

pub(super) fn build() -> Kit {
    with_blades(BLADES)
}

/// The same meadow with another number of blades a tuft.
pub(super) fn with_blades(blades_a_tuft: usize) -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.walk = true;
    kit.daylight();
    kit.look(dvec3(-4.2, EYE_M + 0.1, 4.4), dvec3(0.4, 0.1, 0.2));
    let mut rng = Rng::new(56);
    ground(&mut kit);
    let blades = kit.painted("blades");
    kit.alter(blades, |material: &mut Material| material.double_sided = true);
    let kinds: Vec<u32> =
        (0..KINDS).map(|_| tuft(&mut rng, blades_a_tuft)).map(|mesher| kit.mesh(mesher, blades)).collect();
    let pitch = 2.0 * HALF_M / TUFTS as f32;
    for k in 0..TUFTS * TUFTS {
        let cell = |i: usize, rng: &mut Rng| (i as f32 + 0.5) * pitch - HALF_M + rng.range(-0.12, 0.12);
        let (x, z) = (cell(k % TUFTS, &mut rng), cell(k / TUFTS, &mut rng));
        let yaw = rng.unit() * TAU;
        let at = dvec3(f64::from(x), f64::from(height_m(x, z)), f64::from(z));
        let place = DAffine3::from_translation(at) * DAffine3::from_rotation_y(f64::from(yaw));
        kit.bend("tuft", kinds[rng.index(KINDS)], place, move |share, rest| sway(share as f32, rest, vec2(x, z), yaw));
    }
    kit
}

/// The ground's height; it falls to nothing at the rim.
fn height_m(x: f32, z: f32) -> f32 {
    0.10 * (0.9 * x + 0.4).sin() * (0.7 * z - 0.3).cos() + 0.05 * (1.9 * x - 1.3 * z).sin()
}

fn ground(kit: &mut Kit) {
    let soil = kit.textured("soil", texture::mottled(0x6f7a3c, 12, 0.25));
    let mut mesher = Mesher::new();
    mesher.surface([40, 40], |u, v| {
        let (x, z) = ((u * 2.0 - 1.0) * (HALF_M + 1.0), (1.0 - v * 2.0) * (HALF_M + 1.0));
        let step = 0.01;
        let slope = vec2(height_m(x + step, z) - height_m(x - step, z), height_m(x, z + step) - height_m(x, z - step));
        let normal = vec3(-slope.x, 2.0 * step, -slope.y).normalize_or(Vec3::Y);
        Point { position: vec3(x, height_m(x, z), z), normal, uv: vec2(x, z) * 0.4 }
    });
    let mesh = kit.mesh(mesher, soil);
    kit.place("ground", mesh, DAffine3::IDENTITY);
}

/// Blades around a middle. Each vertex's second texture coordinate is how far up its blade it is, which the wind needs.
fn tuft(rng: &mut Rng, blades: usize) -> Mesher {
    let mut mesher = Mesher::new();
    let tones = [0x7fa03c, 0x6d9236, 0x94ad4c, 0x5c8433, 0xa8b35e, 0x88a845];
    for _ in 0..blades {
        let (around, out) = (rng.unit() * TAU, 0.52 * rng.unit().sqrt());
        let root = vec3(out * around.cos(), -0.03, out * around.sin());
        let lean_way = rng.unit() * TAU;
        let (height, lean) = (rng.range(0.28, 0.62), rng.range(0.08, 0.34));
        let half_width = rng.range(0.009, 0.016);
        let lean_dir = vec3(lean_way.cos(), 0.0, lean_way.sin());
        let across = vec3(-lean_way.sin(), 0.0, lean_way.cos());
        mesher.paint(rng.pick(&tones));
        mesher.surface([1, PIECES], |u, v| {
            let spine = root + Vec3::Y * height * (v - 0.15 * lean * v * v) + lean_dir * lean * v * v;
            let wide = half_width * (1.0 - v * v) * (u * 2.0 - 1.0);
            let up = Vec3::Y * height + lean_dir * 2.0 * lean * v;
            // A blade faces both ways; its light comes from above as much as from its side.
            let normal = (across.cross(up).normalize_or(Vec3::Y) + Vec3::Y * 0.4).normalize_or(Vec3::Y);
            Point { position: spine + across * wide, normal, uv: vec2(u, v) }
        });
    }
    for _ in 0..2 {
        flower(&mut mesher, rng);
    }
    mesher
}

fn flower(mesher: &mut Mesher, rng: &mut Rng) {
    let (x, z, height) = (rng.range(-0.4, 0.4), rng.range(-0.4, 0.4), rng.range(0.35, 0.6));
    let tone = rng.pick(&[0xe8e4d0, 0xd8b43a, 0xb7506a, 0x7d6fb0]);
    // Its parts bend as a whole with the stalk: all of a flower head is as far up as the stalk's end.
    mesher.paint(0x6d9236).surface([1, 2], |u, v| Point {
        position: vec3(x + 0.006 * (2.0 * u - 1.0), height * v, z),
        normal: Vec3::Z,
        uv: vec2(u, v),
    });
    mesher.paint(tone);
    for k in 0..5 {
        let (sin, cos) = (k as f32 / 5.0 * TAU).sin_cos();
        let (out, side) = (vec3(cos, 0.25, sin), vec3(-sin, 0.0, cos));
        mesher.surface([1, 1], |u, v| Point {
            position: vec3(x, height, z) + out * 0.045 * v + side * 0.018 * (0.4 + v) * (2.0 * u - 1.0),
            normal: (Vec3::Y * 0.9 - vec3(cos, 0.0, sin) * 0.2).normalize_or(Vec3::Y),
            uv: vec2(u, 1.0),
        });
    }
}

/// Gusts run over the field along the wind; what is higher up bends more.
fn sway(share: f32, rest: &[Vertex], at: glam::Vec2, yaw: f32) -> Vec<Vertex> {
    let wind_world = vec3(0.82, 0.0, 0.57);
    let (sin, cos) = yaw.sin_cos();
    let gust = |x: f32, z: f32| {
        let along = 0.9 * (0.82 * x + 0.57 * z);
        // Whole turns over the period, so that it repeats.
        0.10 + 0.09 * (TAU * 3.0 * share - along).sin() + 0.035 * (TAU * 7.0 * share - 2.3 * along + x).sin()
    };
    let bent = |vertex: &Vertex| {
        let [x, y, z] = vertex.position;
        let high = vertex.uv[1] * vertex.uv[1];
        let push = gust(at.x + cos * x + sin * z, at.y - sin * x + cos * z) * high;
        // The wind in the turned tuft's own space.
        let local = vec3(cos * wind_world.x - sin * wind_world.z, 0.0, sin * wind_world.x + cos * wind_world.z) * push;
        let normal = (Vec3::from(vertex.normal) + local * 0.8).normalize_or(Vec3::Y);
        Vertex { position: [x + local.x, y - 0.6 * push * push, z + local.z], normal: normal.into(), ..*vertex }
    };
    rest.iter().map(bent).collect()
}

/// Above the blades.
pub(super) fn eyes() -> Vec<SceneCamera> {
    let ring = |k: i32| {
        let around = f64::from(k) / 12.0 * std::f64::consts::TAU;
        let eye = dvec3(4.5 * around.cos(), EYE_M + 0.1, 4.5 * around.sin());
        camera(eye, dvec3(0.3 * around.sin(), 0.2, 0.3 * around.cos()) - eye)
    };
    (0..12).map(ring).collect()
}
