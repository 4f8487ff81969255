//! Two of Newell's teapots on a table.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, Vec2, Vec3, dvec3, vec2, vec3};

use super::kit::Kit;
use super::mesher::{Mesher, Point};
use super::{newell, texture};
use crate::model::Material;

/// Cells a patch along each of its sides.
const CELLS: usize = 16;
const PERIOD_S: f64 = 20.0;
/// The data's pot is 3.15 high; ours stands 0.16 m without its lid's knob.
const METRES_PER_UNIT: f32 = 0.06;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.08, 0.36, 0.62), dvec3(0.0, 0.06, 0.0));
    table(&mut kit);
    let pot = pot(Vec3::ONE);
    let glaze = texture::speckled(0xa8402f, 0x6d2419);
    let red = glazed(&mut kit, "red glaze", glaze);
    let blue = glazed(&mut kit, "blue glaze", texture::marble(0xe6e4da, 0x35588f));
    let (first, second) = (kit.mesh(pot.clone(), red), kit.mesh(pot, blue));
    kit.drive("turning teapot", first, |share| {
        DAffine3::from_translation(dvec3(-0.22, 0.0, -0.02)) * DAffine3::from_rotation_y(0.5 + TAU * share)
    });
    // Lifts, tilts as if it poured, and comes down again.
    kit.drive("pouring teapot", second, |share| {
        let lift = (0.5 - 0.5 * (TAU * 2.0 * share).cos()).powi(2);
        let around = DAffine3::from_rotation_y(2.6 - TAU * share);
        let tilt = DQuat::from_rotation_z(-0.55 * lift);
        let at = dvec3(0.24, 0.0, 0.06) + dvec3(0.0, 0.14 * lift, 0.0);
        DAffine3::from_translation(at) * around * DAffine3::from_quat(tilt)
    });
    kit
}

pub(super) fn glazed(kit: &mut Kit, name: &str, glaze: crate::model::Texture) -> u32 {
    let material = kit.textured(name, glaze);
    // The pot is open at the spout and between body and lid.
    kit.alter(material, |material: &mut Material| {
        material.double_sided = true;
        material.roughness = 0.3;
    });
    material
}

pub(super) fn table(kit: &mut Kit) {
    let wood = kit.textured("oak", texture::planks(0xa87a4c, 6));
    let mut top = Mesher::new();
    top.uv_per_m(1.2).cuboid_cells(vec3(-0.7, -0.04, -0.45), vec3(0.7, 0.0, 0.45), [14, 1, 9]);
    let top = kit.mesh(top, wood);
    kit.place("table", top, DAffine3::IDENTITY);
    let cloth = kit.textured("cloth", texture::tiles([0xd8d3c4, 0x7f9a8c], 0xc9c4b4, 6));
    let mut runner = Mesher::new();
    runner.uv_per_m(2.5).cuboid(vec3(-0.52, 0.0, -0.2), vec3(0.52, 0.003, 0.26));
    let runner = kit.mesh(runner, cloth);
    kit.place("cloth", runner, DAffine3::from_translation(dvec3(0.0, 0.0, 0.0)));
}

/// The pot in metres, y up, standing on y = 0; its spout along +x.
pub(super) fn pot(scale: Vec3) -> Mesher {
    let mut mesher = Mesher::new();
    for patch in &newell::PATCHES {
        // z is up in the data.
        let point = |k: usize| {
            let [x, y, z] = newell::POINTS[usize::from(patch[k])];
            vec3(x, z, -y) * METRES_PER_UNIT * scale
        };
        let points: [Vec3; 16] = std::array::from_fn(point);
        mesher.surface([CELLS, CELLS], |u, v| bezier(&points, u, v));
    }
    mesher
}

/// A point of a bicubic Bezier patch. Where an edge is one point, the normal is that of a place just beside it.
fn bezier(points: &[Vec3; 16], u: f32, v: f32) -> Point {
    let (position, du, dv) = derivatives(points, u, v);
    let normal = du.cross(dv);
    // Chosen: a thirtieth of a cell. Slopes along the edge are some thousandths of their greatest there, which an f32 rounds by 2^-24 of it.
    let beside = |t: f32| t.clamp(2e-3, 1.0 - 2e-3);
    // In square metres: 1e-4 and more where no edge is a point. Where one is, slopes cancel to 0, or to rounding, which makes up to 4e-9 on the lid's knob.
    let normal = if normal.length() > 1e-9 {
        normal
    } else {
        let (_, du, dv) = derivatives(points, beside(u), beside(v));
        du.cross(dv)
    };
    let on_pot: Vec2 = vec2(position.x + 0.6 * position.z, -position.y + 0.4 * position.z) * 3.0;
    Point { position, normal: normal.normalize_or(Vec3::Y), uv: on_pot }
}

fn derivatives(points: &[Vec3; 16], u: f32, v: f32) -> (Vec3, Vec3, Vec3) {
    let (bu, bv) = (bernstein(u), bernstein(v));
    let (su, sv) = (slopes(u), slopes(v));
    let sum =
        |across: [f32; 4], along: [f32; 4]| -> Vec3 { (0..16).map(|k| points[k] * across[k % 4] * along[k / 4]).sum() };
    (sum(bu, bv), sum(su, bv), sum(bu, sv))
}

fn bernstein(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

fn slopes(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t]
}
