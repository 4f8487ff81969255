//! A broad tree: trunk, limbs that branch three times, and bent leaves of some ten triangles each.

use std::f32::consts::TAU;
use std::f64::consts::TAU as TAU64;

use glam::{DAffine3, DQuat, Quat, Vec3, dvec3, vec2, vec3};

use super::kit::Kit;
use super::mesher::{Mesher, Point};
use super::rng::Rng;
use super::texture;
use crate::model::Material;

const LIMBS: usize = 14;
const PERIOD_S: f64 = 10.0;
/// Leaves on each end branch.
const LEAVES: usize = 8;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(3.9, 2.4, 7.4), dvec3(0.0, 3.75, 0.0));
    let bark = kit.textured("bark", texture::bark(0x8a7359));
    let leaf = kit.textured("leaves", texture::mottled(0xf2f4e6, 16, 0.12));
    kit.alter(leaf, |material: &mut Material| material.double_sided = true);
    ground(&mut kit);
    let mut rng = Rng::new(113);
    let trunk = trunk(&mut kit, bark);
    for k in 0..LIMBS {
        let t = k as f32 / (LIMBS - 1) as f32;
        let up = 1.9 + 3.3 * t;
        let foot = at_height(&trunk, up);
        let around = k as f32 * 2.399_963;
        let rise = 0.25 + 0.75 * t * t;
        let way = vec3(around.cos(), rise, around.sin()).normalize_or(Vec3::Y);
        limb(&mut kit, &mut rng, [bark, leaf], foot, way, 2.35 - 0.75 * t);
    }
    kit
}

fn ground(kit: &mut Kit) {
    let lawn = kit.textured("lawn", texture::mottled(0x74893f, 12, 0.20));
    let mut mesher = Mesher::new();
    let rim = [vec2(0.0, -0.35), vec2(2.4, -0.3), vec2(3.3, -0.05), vec2(3.2, 0.0), vec2(1.0, 0.07), vec2(0.0, 0.1)];
    mesher.uv_per_m(0.4).lathe(&rim, 48, 9.0);
    let mesh = kit.mesh(mesher, lawn);
    kit.place("ground", mesh, DAffine3::IDENTITY);
}

fn trunk(kit: &mut Kit, bark: u32) -> Vec<Vec3> {
    let spine: Vec<Vec3> = (0..12)
        .map(|k| {
            let y = k as f32 * 0.5 - 0.15;
            vec3(0.12 * (y * 0.9).sin(), y, 0.10 * (y * 0.7 + 1.0).cos() - 0.05)
        })
        .collect();
    let radii: Vec<f32> = (0..12).map(|k| 0.30 - 0.018 * k as f32 + 0.22 * (-(k as f32) * 1.1).exp()).collect();
    let mut mesher = Mesher::new();
    mesher.uv_per_m(0.7).tube(&spine, &radii, 18);
    let mesh = kit.mesh(mesher, bark);
    kit.place("trunk", mesh, DAffine3::IDENTITY);
    spine
}

fn at_height(spine: &[Vec3], y: f32) -> Vec3 {
    let k = spine.iter().rposition(|p| p.y <= y).unwrap_or(0).min(spine.len() - 2);
    spine[k].lerp(spine[k + 1], ((y - spine[k].y) / (spine[k + 1].y - spine[k].y)).clamp(0.0, 1.0))
}

/// One limb with all that grows on it, in a space whose origin is where it leaves the trunk: it sways about that point as
/// a whole.
fn limb(kit: &mut Kit, rng: &mut Rng, [bark, leaf]: [u32; 2], foot: Vec3, way: Vec3, length: f32) {
    let (mut wood, mut leaves) = (Mesher::new(), Mesher::new());
    wood.uv_per_m(1.0);
    let twig = Twig { at: Vec3::ZERO, way, length, thick: 0.045 * length, depth: 0 };
    grow(&mut wood, &mut leaves, rng, &twig);
    let (wood, leaves) = (kit.mesh(wood, bark), kit.mesh(leaves, leaf));
    let (phase, axis) = (f64::from(rng.unit()), way.cross(Vec3::Y).normalize_or(Vec3::X).as_dvec3());
    let sway = move |share: f64| {
        let nod = 0.022 * (TAU64 * (2.0 * share + phase)).sin() + 0.010 * (TAU64 * (5.0 * share + 2.0 * phase)).sin();
        let swing = 0.018 * (TAU64 * (3.0 * share + 0.4 + phase)).sin();
        let turn = DQuat::from_axis_angle(axis, nod) * DQuat::from_rotation_y(swing);
        DAffine3::from_rotation_translation(turn, foot.as_dvec3())
    };
    kit.drive("limb", wood, sway);
    kit.drive("leaves", leaves, sway);
}

struct Twig {
    at: Vec3,
    way: Vec3,
    length: f32,
    thick: f32,
    depth: usize,
}

/// Grows a branch that bends upwards, its side branches, and leaves on the last ones.
fn grow(wood: &mut Mesher, leaves: &mut Mesher, rng: &mut Rng, twig: &Twig) {
    let pieces = [7, 5, 4][twig.depth];
    let mut spine = vec![twig.at];
    let mut way = twig.way;
    for _ in 0..pieces {
        let stray = vec3(rng.range(-0.25, 0.25), rng.range(-0.12, 0.16), rng.range(-0.25, 0.25));
        way = (way + stray).normalize_or(way);
        spine.push(spine[spine.len() - 1] + way * twig.length / pieces as f32);
    }
    let radii: Vec<f32> = (0..=pieces).map(|k| twig.thick * (1.0 - 0.72 * k as f32 / pieces as f32)).collect();
    wood.tube(&spine, &radii, [10, 6, 4][twig.depth]);
    if twig.depth == 2 {
        for k in 0..LEAVES {
            let t = (k as f32 + 0.5) / LEAVES as f32 * pieces as f32;
            let at = spine[t as usize].lerp(spine[t as usize + 1], t.fract());
            leaf(leaves, rng, at, way);
        }
        return;
    }
    let children = [8, 8][twig.depth];
    for k in 0..children {
        // Not quite to the last point, as one must come after it.
        let t = (0.25 + 0.75 * k as f32 / (children - 1) as f32) * pieces as f32 * 0.999;
        let at = spine[t as usize].lerp(spine[t as usize + 1], t.fract());
        let around = k as f32 * 2.399_963 + rng.range(-0.4, 0.4);
        let out = Quat::from_axis_angle(way, around) * way.any_orthonormal_vector();
        let open = if k == children - 1 { 0.15 } else { rng.range(0.8, 1.5) };
        let way = (way + out * open + Vec3::Y * 0.12).normalize_or(way);
        let child = Twig {
            at,
            way,
            length: twig.length * rng.range(0.42, 0.56),
            thick: radii[t as usize] * 0.62,
            depth: twig.depth + 1,
        };
        grow(wood, leaves, rng, &child);
    }
}

/// A pointed leaf, bent along its middle, on a short stalk's length away from its branch.
fn leaf(mesher: &mut Mesher, rng: &mut Rng, at: Vec3, along: Vec3) {
    let around = rng.unit() * TAU;
    let out = vec3(around.cos(), rng.range(-0.5, 0.5), around.sin());
    let tip_way = (out + along * 0.6).normalize_or(Vec3::X);
    let across = tip_way.cross(Vec3::Y).normalize_or(Vec3::Z);
    let up = across.cross(tip_way).normalize_or(Vec3::Y);
    let (length, half_width) = (rng.range(0.28, 0.40), rng.range(0.09, 0.13));
    mesher.paint(rng.pick(&[0x5d8433, 0x6f9a3b, 0x7fa544, 0x4f7630, 0x8cab4e, 0x698f3f]));
    mesher.surface([2, 3], |u, v| {
        let (s, droop) = (u * 2.0 - 1.0, 0.35 * v * v);
        let wide = half_width * [0.25, 0.95, 0.75, 0.0][(v * 3.0).round() as usize];
        let fold = 0.35 * s.abs() * wide;
        let position = at + tip_way * (0.02 + length * v) + across * wide * s + up * (fold - droop * length * 0.6);
        let normal = (up + tip_way * droop - across * 0.35 * s).normalize_or(Vec3::Y);
        Point { position, normal, uv: vec2(u, v) }
    });
}
