//! Houses: walls with real window openings, and everything on them.

use glam::{Affine3A, DAffine3, Quat, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

use crate::builtin::kit::Kit;
use crate::builtin::mesher::Mesher;
use crate::builtin::rng::Rng;

const FLOOR_M: f32 = 3.0;
const WINDOW_M: [f32; 2] = [1.15, 1.5];
const SILL_M: f32 = 0.95;
const REVEAL_M: f32 = 0.2;

/// What one house looks like.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    pub width_m: f32,
    pub depth_m: f32,
    pub floors: usize,
    /// Windows a floor on the front, back and each side.
    pub windows: [usize; 3],
    pub flat_roof: bool,
    /// sRGB of walls (over their texture), frames, door and roof.
    pub tones: [u32; 4],
}

/// Walls use the first material, the rest the second.
pub(super) fn build(kit: &mut Kit, plan: &Plan, materials: [u32; 2], place: DAffine3, rng: &mut Rng) {
    let (mut walls, mut trim) = (Mesher::new(), Mesher::new());
    walls.paint(plan.tones[0]).uv_per_m(0.5);
    let (half_w, half_d) = (plan.width_m / 2.0, plan.depth_m / 2.0);
    let sides = [
        (0.0, vec3(-half_w, 0.0, half_d), plan.width_m, plan.windows[0], true),
        (PI, vec3(half_w, 0.0, -half_d), plan.width_m, plan.windows[1], false),
        (FRAC_PI_2, vec3(half_w, 0.0, half_d), plan.depth_m, plan.windows[2], false),
        (-FRAC_PI_2, vec3(-half_w, 0.0, -half_d), plan.depth_m, plan.windows[2], false),
    ];
    for (yaw, origin, width, columns, door) in sides {
        let frame = Affine3A::from_rotation_translation(Quat::from_rotation_y(yaw), origin);
        let facade = Facade { frame, width, columns, floors: plan.floors, door };
        facade.build(&mut walls, &mut trim, plan, rng);
    }
    let height = plan.floors as f32 * FLOOR_M;
    trim.frame(Affine3A::IDENTITY);
    if plan.flat_roof {
        flat_roof(&mut trim, plan, height);
    } else {
        gable(&mut walls, &mut trim, plan, height);
        let at = vec3(rng.range(-0.3, 0.3) * plan.width_m, 0.0, rng.range(-0.25, -0.15) * plan.depth_m);
        chimney(&mut trim, at + Vec3::Y * height);
    }
    let walls = kit.mesh(walls, materials[0]);
    let trim = kit.mesh(trim, materials[1]);
    kit.place("house walls", walls, place);
    kit.place("house trim", trim, place);
}

/// One side of a house; its frame has x along it, y up and z outwards.
struct Facade {
    frame: Affine3A,
    width: f32,
    columns: usize,
    floors: usize,
    door: bool,
}

impl Facade {
    fn build(&self, walls: &mut Mesher, trim: &mut Mesher, plan: &Plan, rng: &mut Rng) {
        walls.frame(self.frame);
        trim.frame(self.frame);
        let height = self.floors as f32 * FLOOR_M;
        if self.columns == 0 {
            walls.upright(vec2(0.0, 0.0), vec2(self.width, height));
            return;
        }
        let pitch = self.width / self.columns as f32;
        let mut xs = vec![0.0];
        xs.extend((0..self.columns).flat_map(|k| {
            let middle = (k as f32 + 0.5) * pitch;
            [middle - WINDOW_M[0] / 2.0, middle + WINDOW_M[0] / 2.0]
        }));
        xs.push(self.width);
        let mut ys = vec![0.0];
        ys.extend((0..self.floors).flat_map(|k| {
            let sill = k as f32 * FLOOR_M + SILL_M;
            [sill, sill + WINDOW_M[1]]
        }));
        ys.push(height);
        let door_column = self.door.then_some(2 * (self.columns / 2) + 1);
        for j in 0..ys.len() - 1 {
            for i in 0..xs.len() - 1 {
                let (low, high) = (vec2(xs[i], ys[j]), vec2(xs[i + 1], ys[j + 1]));
                let in_door = door_column == Some(i) && j < 2;
                if in_door && j == 1 {
                    self.door(trim, [xs[i], xs[i + 1], ys[2]], plan);
                } else if !in_door && i % 2 == 1 && j % 2 == 1 {
                    window(trim, [low.x, high.x, low.y, high.y], plan, rng);
                } else if !in_door {
                    walls.upright(low, high);
                }
            }
        }
    }

    fn door(&self, trim: &mut Mesher, [left, right, top]: [f32; 3], plan: &Plan) {
        reveal(trim, [left, right, 0.0, top], plan.tones[1]);
        trim.paint(plan.tones[2]);
        trim.cuboid(vec3(left, 0.0, -REVEAL_M - 0.05), vec3(right, top - 0.35, -REVEAL_M + 0.03));
        trim.paint(0x39444c).quad(opening([left, right, top - 0.35, top], -REVEAL_M));
        trim.paint(0x8f8a80).cuboid(vec3(left - 0.2, 0.0, 0.0), vec3(right + 0.2, 0.16, 0.55));
        trim.paint(plan.tones[1]).cuboid(vec3(left - 0.15, top + 0.05, 0.0), vec3(right + 0.15, top + 0.15, 0.6));
    }
}

fn opening([left, right, low, high]: [f32; 4], z: f32) -> [Vec3; 4] {
    [vec3(left, low, z), vec3(right, low, z), vec3(right, high, z), vec3(left, high, z)]
}

/// The four inner sides of an opening.
fn reveal(trim: &mut Mesher, rectangle: [f32; 4], tone: u32) {
    let (outer, inner) = (opening(rectangle, 0.0), opening(rectangle, -REVEAL_M));
    trim.paint(tone);
    for k in 0..4 {
        let next = (k + 1) % 4;
        trim.quad([outer[k], outer[next], inner[next], inner[k]]);
    }
}

fn window(trim: &mut Mesher, rectangle: [f32; 4], plan: &Plan, rng: &mut Rng) {
    let [left, right, low, high] = rectangle;
    reveal(trim, rectangle, plan.tones[1]);
    trim.paint(rng.pick(&[0x33424f, 0x3d4c57, 0x2a3742, 0x55626a, 0x8d8a78])).quad(opening(rectangle, -REVEAL_M));
    let middle = (left + right) / 2.0;
    trim.paint(plan.tones[1]);
    trim.quad(opening([middle - 0.035, middle + 0.035, low, high], -REVEAL_M + 0.04));
    trim.quad(opening([left, right, low + 0.98, low + 1.05], -REVEAL_M + 0.045));
    ledge(trim, vec3(left - 0.08, low - 0.09, 0.0), vec3(right + 0.08, low, 0.14));
}

/// A sill: only the sides that show.
fn ledge(trim: &mut Mesher, low: Vec3, high: Vec3) {
    let at = |x: f32, y: f32, z: f32| vec3(x, y, z);
    trim.quad([
        at(low.x, high.y, high.z),
        at(high.x, high.y, high.z),
        at(high.x, high.y, low.z),
        at(low.x, high.y, low.z),
    ]);
    trim.quad([
        at(low.x, low.y, high.z),
        at(high.x, low.y, high.z),
        at(high.x, high.y, high.z),
        at(low.x, high.y, high.z),
    ]);
    trim.quad([at(low.x, low.y, low.z), at(high.x, low.y, low.z), at(high.x, low.y, high.z), at(low.x, low.y, high.z)]);
}

fn flat_roof(trim: &mut Mesher, plan: &Plan, height: f32) {
    let (w, d) = (plan.width_m / 2.0, plan.depth_m / 2.0);
    trim.paint(plan.tones[3]).cuboid(vec3(-w - 0.25, height, -d - 0.25), vec3(w + 0.25, height + 0.35, d + 0.25));
    trim.paint(plan.tones[1]).cuboid(vec3(-w * 0.3, height + 0.35, -d * 0.5), vec3(w * 0.15, height + 2.3, d * 0.1));
}

/// A gabled roof whose ridge runs along x, with the triangles of wall below it.
fn gable(walls: &mut Mesher, trim: &mut Mesher, plan: &Plan, height: f32) {
    let (w, d) = (plan.width_m / 2.0, plan.depth_m / 2.0);
    let rise = plan.depth_m * 0.36;
    walls.frame(Affine3A::IDENTITY);
    for side in [1.0f32, -1.0] {
        let foot = |z: f32| vec3(side * w, height, z * side);
        walls.polygon(&[foot(d), foot(-d), vec3(side * w, height + rise, 0.0)]);
    }
    let (over_x, over, thick) = (w + 0.02, 0.45, 0.2);
    let drop = over * rise / d;
    let ridge = |x: f32, y: f32| vec3(x, height + rise + y, 0.0);
    let eave = |x: f32, y: f32, side: f32| vec3(x, height - drop + y, side * (d + over));
    trim.paint(plan.tones[3]);
    for side in [1.0f32, -1.0] {
        let (l, r) = (-over_x * side, over_x * side);
        let (top, low) = (thick, 0.0);
        trim.quad([eave(l, top, side), eave(r, top, side), ridge(r, top), ridge(l, top)]);
        trim.quad([eave(r, low, side), eave(l, low, side), ridge(l, low), ridge(r, low)]);
        trim.quad([eave(l, low, side), eave(r, low, side), eave(r, top, side), eave(l, top, side)]);
        trim.quad([eave(r, low, side), ridge(r, low), ridge(r, top), eave(r, top, side)]);
        trim.quad([ridge(l, low), eave(l, low, side), eave(l, top, side), ridge(l, top)]);
    }
}

fn chimney(trim: &mut Mesher, at: Vec3) {
    trim.paint(0x8a5240).cuboid(at + vec3(-0.35, 0.8, -0.3), at + vec3(0.35, 4.3, 0.3));
    trim.paint(0x4a4440).cuboid(at + vec3(-0.42, 4.3, -0.37), at + vec3(0.42, 4.45, 0.37));
}
