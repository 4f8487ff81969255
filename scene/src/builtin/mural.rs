//! A painted wall with a shallow relief that hides nothing from whoever stands before it: one image holds all of it.

use std::f32::consts::TAU;

use glam::{DAffine3, Vec3, dvec3, vec2, vec3};

use super::kit::Kit;
use super::mesher::{Mesher, Point};
use super::texture;

const WIDTH_M: f32 = 8.0;
const HEIGHT_M: f32 = 3.0;
/// Bumps along the wall and up.
const BUMPS: [f32; 2] = [8.0, 3.0];
/// With one bump a metre, no slope is steeper than a quarter.
const DEPTH_M: f32 = 0.04;
const PERIOD_S: f64 = 10.0;

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.0, 1.6, 10.0), dvec3(0.0, 1.5, 0.0));
    let paint = kit.textured("fresco", texture::marble(0xd8c39a, 0x6b4a3a));
    let mut wall = Mesher::new();
    wall.surface([160, 60], |u, v| {
        let (across, up) = (TAU * BUMPS[0] * u, TAU * BUMPS[1] * v);
        let slope = vec2(-across.sin() * up.cos() * BUMPS[0] / WIDTH_M, -across.cos() * up.sin() * BUMPS[1] / HEIGHT_M);
        let slope = slope * (TAU * DEPTH_M);
        Point {
            position: vec3((u - 0.5) * WIDTH_M, v * HEIGHT_M, DEPTH_M * across.cos() * up.cos()),
            normal: Vec3::new(-slope.x, -slope.y, 1.0).normalize(),
            uv: vec2(2.0 * u, 1.0 - v),
        }
    });
    let wall = kit.mesh(wall, paint);
    kit.drive("mural", wall, |share| {
        DAffine3::from_translation(dvec3(0.4 * (std::f64::consts::TAU * share).sin(), 0.0, 0.0))
    });
    kit
}
