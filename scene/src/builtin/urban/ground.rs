//! Where blocks and streets lie.

use glam::{DAffine3, DVec2, dvec2, dvec3, vec3};

use crate::builtin::kit::Kit;
use crate::builtin::mesher::Mesher;

/// Blocks along x and z.
pub(super) const BLOCKS: [usize; 2] = [3, 2];
pub(super) const BLOCK_M: f64 = 36.0;
pub(super) const STREET_M: f64 = 12.0;
pub(super) const PITCH_M: f64 = BLOCK_M + STREET_M;
pub(super) const PAVEMENT_M: f64 = 3.0;
pub(super) const KERB_M: f64 = 0.12;

/// Half the extent of the streets' outer kerbs.
pub(super) fn outer() -> DVec2 {
    dvec2(BLOCKS[0] as f64, BLOCKS[1] as f64) * PITCH_M / 2.0 + DVec2::splat(STREET_M / 2.0)
}

pub(super) fn blocks() -> impl Iterator<Item = DVec2> {
    let middle = |k: usize, count: usize| (k as f64 - (count as f64 - 1.0) / 2.0) * PITCH_M;
    (0..BLOCKS[0]).flat_map(move |i| (0..BLOCKS[1]).map(move |j| dvec2(middle(i, BLOCKS[0]), middle(j, BLOCKS[1]))))
}

/// A slab of ground between two corners (x, z).
pub(super) fn slab(kit: &mut Kit, name: &str, material: u32, [low, high]: [DVec2; 2], top_m: f64, uv_per_m: f32) {
    let (centre, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let mut mesher = Mesher::new();
    let (w, d) = (half.x as f32, half.y as f32);
    mesher.uv_per_m(uv_per_m).cuboid(vec3(-w, -0.3, -d), vec3(w, 0.0, d));
    let mesh = kit.mesh(mesher, material);
    kit.place(name, mesh, DAffine3::from_translation(dvec3(centre.x, top_m, centre.y)));
}
