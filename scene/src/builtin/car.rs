//! Cars: a painted body with windows, and four wheels that turn.

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DQuat, Quat, Vec2, Vec3, dvec3, vec2, vec3};

use super::kit::Kit;
use super::mesher::Mesher;

/// Metres.
const WHEEL_RADIUS_M: f64 = 0.32;
const AXLES_M: [f64; 2] = [-1.28, 1.30];
const HALF_TRACK_M: f64 = 0.80;

/// A way rounded to whole turns of a wheel, so that wheels come around where cars do.
pub(super) fn rolled_m(way_m: f64) -> f64 {
    let around = std::f64::consts::TAU * WHEEL_RADIUS_M;
    (way_m / around).round() * around
}

/// The shape of the cabin.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    Saloon,
    Hatchback,
    Van,
}

/// Body and wheel meshes of one car.
#[derive(Debug, Clone, Copy)]
pub(super) struct Car {
    body: u32,
    wheel: u32,
    tone: u32,
    /// Of the object that is the body.
    name: &'static str,
}

/// A car's place and the metres its wheels have rolled, after a share of the scene's period.
pub(super) type Drive = Arc<dyn Fn(f64) -> (DAffine3, f64) + Send + Sync>;

impl Car {
    pub fn new(kit: &mut Kit, material: u32, shape: Shape, tone: u32, wheel: u32) -> Self {
        let mut mesher = Mesher::new();
        let hull: &[Vec2] = &[
            vec2(2.10, 0.32),
            vec2(2.16, 0.52),
            vec2(2.02, 0.78),
            vec2(1.05, 0.94),
            vec2(-1.60, 0.96),
            vec2(-2.08, 0.88),
            vec2(-2.14, 0.50),
            vec2(-2.04, 0.30),
        ];
        let cabin: [Vec2; 4] = match shape {
            Shape::Saloon => [vec2(1.00, 0.93), vec2(0.35, 1.42), vec2(-0.85, 1.44), vec2(-1.55, 0.95)],
            Shape::Hatchback => [vec2(1.05, 0.93), vec2(0.45, 1.46), vec2(-1.40, 1.47), vec2(-1.98, 0.92)],
            Shape::Van => [vec2(1.55, 0.86), vec2(1.10, 1.82), vec2(-1.98, 1.86), vec2(-2.06, 0.90)],
        };
        mesher.paint(tone);
        loft(&mut mesher, hull, 0.86);
        windows(&mut mesher, cabin, tone);
        for x in [-0.62f32, 0.62] {
            mesher.paint(0xf0ead2).cuboid(vec3(x - 0.17, 0.62, 2.0), vec3(x + 0.17, 0.74, 2.13));
            mesher.paint(0x8f1d1a).cuboid(vec3(x - 0.17, 0.66, -2.15), vec3(x + 0.17, 0.80, -2.0));
        }
        mesher.paint(0x23252a).cuboid(vec3(-0.80, 0.30, 1.9), vec3(0.80, 0.46, 2.2));
        mesher.cuboid(vec3(-0.80, 0.30, -2.2), vec3(0.80, 0.46, -1.9));
        Car { body: kit.mesh(mesher, material), wheel, tone: 0xffffff, name: "car" }
    }

    /// The same car, white until now, in another colour.
    pub fn in_tone(self, tone: u32) -> Car {
        Car { tone, ..self }
    }

    /// The same car, its body by another name.
    pub fn called(self, name: &'static str) -> Car {
        Car { name, ..self }
    }

    /// The wheel that all cars share.
    pub fn wheel(kit: &mut Kit, material: u32) -> u32 {
        let mut mesher = Mesher::new();
        let lying = Quat::from_rotation_z(-std::f32::consts::FRAC_PI_2);
        mesher.frame(Affine3A::from_quat(lying));
        let radius = WHEEL_RADIUS_M as f32;
        let tyre = [(0.0, -0.10), (radius, -0.10), (radius, 0.07), (0.19, 0.105)];
        mesher.paint(0x1d1d1f).lathe(&tyre.map(|(r, y)| vec2(r, y)), 12, 1.0);
        mesher.paint(0xa8abb0).lathe(&[vec2(0.19, 0.105), vec2(0.0, 0.085)], 12, 1.0);
        // Spokes show that it turns.
        for k in 0..2 {
            let turned = lying * Quat::from_rotation_y(k as f32 * std::f32::consts::FRAC_PI_2);
            mesher.frame(Affine3A::from_quat(turned)).paint(0x54575c);
            mesher.cuboid(vec3(-0.17, 0.09, -0.022), vec3(0.17, 0.115, 0.022));
        }
        kit.mesh(mesher, material)
    }

    /// Places a car that drives.
    pub fn drive(&self, kit: &mut Kit, drive: &Drive) {
        let body = Arc::clone(drive);
        kit.drive(self.name, self.body, move |share| body(share).0);
        kit.tint(self.tone);
        for (z, side) in AXLES_M.into_iter().flat_map(|z| [(z, -1.0), (z, 1.0)]) {
            let drive = Arc::clone(drive);
            // The hub cap faces outwards on both sides.
            let facing = DQuat::from_rotation_y(if side < 0.0 { std::f64::consts::PI } else { 0.0 });
            kit.drive("wheel", self.wheel, move |share| {
                let (world_from_car, rolled_m) = drive(share);
                let roll = DQuat::from_rotation_x(rolled_m / WHEEL_RADIUS_M);
                let at = dvec3(side * HALF_TRACK_M, WHEEL_RADIUS_M, z);
                world_from_car * DAffine3::from_rotation_translation(roll * facing, at)
            });
        }
    }
}

/// A convex side view (z, y), from its front foot up and over to its back foot, given the half width `half_m` with
/// rounded sides.
fn loft(mesher: &mut Mesher, outline: &[Vec2], half_m: f32) {
    let middle = outline.iter().sum::<Vec2>() / outline.len() as f32;
    let ring = |x: f32, scale: f32| -> Vec<Vec3> {
        outline.iter().map(|&p| middle + (p - middle) * scale).map(|p| vec3(x, p.y, p.x)).collect()
    };
    let shoulder = half_m - 0.09;
    let rings = [ring(half_m, 0.86), ring(shoulder, 1.0), ring(-shoulder, 1.0), ring(-half_m, 0.86)];
    strips(mesher, &rings);
    caps(mesher, &rings[0], &rings[3]);
}

/// Closes neighbouring rings, from +x to -x, with quadrilaterals that face outwards.
fn strips(mesher: &mut Mesher, rings: &[Vec<Vec3>]) {
    for pair in rings.windows(2) {
        for i in 0..pair[0].len() {
            let j = (i + 1) % pair[0].len();
            mesher.quad([pair[0][i], pair[0][j], pair[1][j], pair[1][i]]);
        }
    }
}

fn caps(mesher: &mut Mesher, right: &[Vec3], left: &[Vec3]) {
    let reversed: Vec<Vec3> = right.iter().rev().copied().collect();
    mesher.polygon(&reversed);
    mesher.polygon(left);
}

/// The cabin: glass all around under a painted roof, narrower at the top, with painted pillars between.
fn windows(mesher: &mut Mesher, [front, roof_front, roof_back, back]: [Vec2; 4], tone: u32) {
    let (low, high) = (0.80f32, 0.62f32);
    let at = |p: Vec2, x: f32| vec3(x, p.y, p.x);
    let glass = 0x2b3a46;
    mesher.paint(glass);
    mesher.quad([at(front, -low), at(front, low), at(roof_front, high), at(roof_front, -high)]);
    mesher.quad([at(back, low), at(back, -low), at(roof_back, -high), at(roof_back, high)]);
    let parts = [0.0f32, 0.04, 0.46, 0.52, 0.95, 1.0];
    for (k, pair) in parts.windows(2).enumerate() {
        mesher.paint(if k % 2 == 1 { glass } else { tone });
        let point =
            |t: f32, side: f32| (at(front.lerp(back, t), side * low), at(roof_front.lerp(roof_back, t), side * high));
        for side in [1.0f32, -1.0] {
            let ((a, b), (c, d)) = (point(pair[0], side), point(pair[1], side));
            mesher.quad(if side > 0.0 { [a, c, d, b] } else { [c, a, b, d] });
        }
    }
    mesher.paint(tone);
    let (f, b) = (at(roof_front, high), at(roof_back, high));
    let (g, c) = (at(roof_front, -high), at(roof_back, -high));
    mesher.quad([g, f, b, c]);
}
