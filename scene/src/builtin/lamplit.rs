//! The two teapots under lamps with an area: a wide one that swings, and a small round one that stands still.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::kit::Kit;
use super::teapots;
use crate::model::{LightArea, SceneLight};

pub(super) fn build() -> Kit {
    let mut kit = teapots::build();
    kit.darken();
    kit.look(dvec3(0.1, 0.42, 0.66), dvec3(0.0, 0.03, 0.0));
    // Half a metre wide, 0.7 m above the table, facing it as it swings.
    kit.hang(|share| {
        let (sin, cos) = (0.5 * (TAU * 2.0 * share).sin()).sin_cos();
        let half_world = [dvec3(0.25 * cos, 0.25 * sin, 0.0), dvec3(0.0, 0.0, 0.12)];
        panel(dvec3(0.25 * sin, 0.7 - 0.1 * (1.0 - cos), 0.0), half_world, false, [1.0, 0.93, 0.8])
    });
    kit.hang(|_| {
        let half_world = [dvec3(0.0, 0.04, -0.03), dvec3(0.0, 0.03, 0.04)];
        panel(dvec3(-0.65, 0.35, 0.25), half_world, true, [0.35, 0.42, 0.6])
    });
    kit
}

fn panel(position_world: DVec3, half_world: [DVec3; 2], is_disc: bool, colour: [f32; 3]) -> SceneLight {
    SceneLight::Point {
        position_world,
        colour,
        direction_world: half_world[0].cross(half_world[1]).normalize(),
        spot_angles_rad: None,
        range_m: f32::INFINITY,
        area: Some(LightArea { half_world, is_disc }),
    }
}
