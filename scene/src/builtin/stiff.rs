//! Scenes that strain the numbers: far away, tiny, huge, of extreme depth range, with broken triangles.

use glam::{DAffine3, DVec3, Vec3, dvec3, vec3};

use super::kit::Kit;
use super::mesher::Mesher;
use super::rng::Rng;
use super::teapots;
use super::texture;
use crate::sanitize::sanitize;

/// A still life of about one metre, scaled and moved as a whole: (mesh from unit) stays in f32, the rest in f64.
fn still_life(scale: f64, origin: DVec3) -> Kit {
    let mut kit = Kit::new(8.0);
    kit.daylight();
    let world_from_unit = DAffine3::from_translation(origin) * DAffine3::from_scale(DVec3::splat(scale));
    let wood = kit.textured("board", texture::planks(0xa87a4c, 6));
    let clay = kit.textured("clay", texture::mottled(0xb5643f, 10, 0.15));
    let stone = kit.textured("stone", texture::marble(0xd8d4c8, 0x6b7480));
    kit.alter(clay, |material| material.double_sided = true);
    let mut board = Mesher::new();
    board.cuboid_cells(vec3(-0.6, -0.05, -0.4), vec3(0.6, 0.0, 0.4), [8, 1, 6]);
    let board = kit.mesh(board, wood);
    kit.place("board", board, world_from_unit);
    let pot = kit.mesh(teapots::pot(Vec3::ONE), clay);
    kit.drive("pot", pot, move |share| {
        let turn = DAffine3::from_rotation_y(0.6 + std::f64::consts::TAU * share);
        world_from_unit * DAffine3::from_translation(dvec3(-0.18, 0.0, 0.0)) * turn
    });
    let mut ball = Mesher::new();
    ball.ellipsoid(Vec3::splat(0.12), [32, 24]);
    let ball = kit.mesh(ball, stone);
    kit.place("ball", ball, world_from_unit * DAffine3::from_translation(dvec3(0.24, 0.12, 0.02)));
    let (eye, target) = (dvec3(0.1, 0.42, 0.85), dvec3(0.0, 0.06, 0.0));
    kit.look(world_from_unit.transform_point3(eye), world_from_unit.transform_point3(target));
    kit
}

/// 1e7 m from the origin.
pub(super) fn far() -> Kit {
    still_life(1.0, dvec3(1.0e7, 2.0, -6.0e6))
}

/// A tenth of a millimetre across.
pub(super) fn tiny() -> Kit {
    still_life(1.0e-4, DVec3::ZERO)
}

/// A thousand kilometres across.
pub(super) fn huge() -> Kit {
    still_life(1.0e6, DVec3::ZERO)
}

/// Beads 0.1 m from the eye and mountains at 1e5 m.
pub(super) fn near_far() -> Kit {
    let mut kit = Kit::new(8.0);
    kit.daylight();
    kit.look(DVec3::ZERO, dvec3(0.0, 0.0, -1.0));
    let clay = kit.textured("bead", texture::mottled(0xc9a24e, 10, 0.15));
    let mut bead = Mesher::new();
    bead.ellipsoid(Vec3::splat(0.012), [24, 16]);
    let bead = kit.mesh(bead, clay);
    for k in 0..5 {
        let at = dvec3(f64::from(k - 2) * 0.03, -0.02 + 0.006 * f64::from(k), -0.115);
        kit.drive("bead", bead, move |share| {
            DAffine3::from_translation(at) * DAffine3::from_rotation_y(std::f64::consts::TAU * share)
        });
    }
    let plain = kit.textured("plain", texture::mottled(0x7f8a58, 8, 0.2));
    let mut rng = Rng::new(1_000_000);
    // Each ring of hills is ten times as far and as high as the one before.
    for power in 1..=5 {
        let distance = 10f64.powi(power);
        let mut hill = Mesher::new();
        let size = distance as f32;
        hill.ellipsoid(vec3(0.35, 0.12, 0.2) * size, [32, 16]);
        let hill = kit.mesh(hill, plain);
        for k in -2..=2 {
            let around = f64::from(k) * 0.32 + f64::from(rng.range(-0.1, 0.1));
            let at = dvec3(around.sin(), -0.13 + 0.02 * f64::from(power), -around.cos()) * distance;
            kit.place("hill", hill, DAffine3::from_translation(at));
        }
    }
    kit
}

/// Good triangles around one without area, one with a corner that is not a number and one with an infinite corner.
pub(super) fn degenerate() -> Kit {
    let mut kit = still_life(1.0, DVec3::ZERO);
    let tone = kit.painted("sheet");
    let mut sheet = Mesher::new();
    sheet.paint(0x7a9ab5).panel(vec3(-0.2, 0.0, -0.3), Vec3::X * 0.4, Vec3::Y * 0.3, [4, 3]);
    let mut mesh = sheet.finish(tone);
    let corner = mesh.vertices[0];
    for broken in [f32::NAN, f32::INFINITY] {
        mesh.indices.extend([0, 1, mesh.vertices.len() as u32]);
        let mut vertex = corner;
        vertex.position[1] = broken;
        mesh.vertices.push(vertex);
    }
    mesh.indices.splice(6..6, [2, 2, 3]);
    let dropped = sanitize(&mut mesh);
    kit.warnings.push(format!("sheet: {dropped}"));
    let sheet = kit.raw_mesh(mesh);
    kit.place("sheet", sheet, DAffine3::IDENTITY);
    kit
}
