//! Objects under transforms that are stiff, without moving.

use glam::{DAffine3, DMat3, DVec3};

use super::stiff::{Stiff, bent, flat};
use crate::topics::stability::build::{Placed, at, ball, scene, square};
use crate::topics::stability::case::Case;

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "mirrored", judge: |lab| bent(lab, &balls(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))) },
    Stiff { name: "turned inside out", judge: |lab| bent(lab, &balls(DMat3::from_diagonal(DVec3::splat(-1.0)))) },
    Stiff {
        name: "flattened to a hundredth",
        judge: |lab| bent(lab, &balls(DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.01)))),
    },
    Stiff { name: "sheared by two", judge: |lab| bent(lab, &balls(shear(2.0))) },
    Stiff { name: "a board of 1e-6 by 1e6 of its own size", judge: |lab| flat(lab, &board()) },
    Stiff { name: "scaled to a millionth, as where a scale vanishes", judge: |lab| flat(lab, &vanished(1e-6)) },
    Stiff { name: "scaled to 1e-30", judge: |lab| flat(lab, &vanished(1e-30)) },
];

fn back() -> Placed {
    Placed { mesh: square(), world_from_mesh: at(DVec3::NEG_Z, 1.5), colour: [0.5, 0.4, 0.3] }
}

/// What lies higher lies further to the right.
fn shear(by: f64) -> DMat3 {
    DMat3::from_cols(DVec3::X, DVec3::new(by, 1.0, 0.0), DVec3::Z)
}

fn seen(parts: Vec<Placed>) -> Case {
    Case::look(scene("placed", parts), DVec3::new(0.3, 0.4, 2.5), DVec3::ZERO, 0.01)
}

/// A ball under a map, before a wall.
fn balls(matrix3: DMat3) -> Case {
    let world_from_mesh = DAffine3 { matrix3: matrix3 * 0.35, translation: DVec3::ZERO };
    seen(vec![back(), Placed { mesh: ball(96), world_from_mesh, colour: [0.7, 0.3, 0.2] }])
}

/// A board of a metre, whose mesh is a millionth as wide and a million times as high.
fn board() -> Case {
    let mut mesh = square();
    for vertex in &mut mesh.vertices {
        vertex.position[0] *= 1e-6;
        vertex.position[1] *= 1e6;
    }
    let world_from_mesh = DAffine3::from_scale(DVec3::new(5e5, 5e-7, 1.0));
    seen(vec![back(), Placed { mesh, world_from_mesh, colour: [0.2, 0.4, 0.7] }])
}

/// A ball that is next to nothing before a wall: it shows at most in one pixel, and must not show anywhere else.
fn vanished(scale: f64) -> Case {
    seen(vec![back(), Placed { mesh: ball(8), world_from_mesh: at(DVec3::ZERO, scale), colour: [0.7, 0.3, 0.2] }])
}
