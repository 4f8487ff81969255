//! What would stop who walks on: a small picture along his way, of all that is held.

use camera::{ImagePoint, Pinhole, Rigid};
use glam::{DVec3, Vec2, Vec3};
use gpu::Gpu;

use crate::draw::held_pass::HeldPass;
use crate::draw::peek::{Peek, Seen};
use crate::draw::shown::Shown;

/// Pixels a side, and half of the field: who is a body's width from a wall sees 45 degrees to both sides that which his shoulders meet.
const SIDE_PX: u32 = 24;
const FIELD_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// What is met lies so far below the eye at most, in bodies: what is lower, 0.8 m below a person's eye, is stepped over.
const BELOW_BODIES: f64 = 3.5;
/// The upward part of a normal of what is walked on, as a slope or a stair's tread: 45 degrees.
const WALKED_ON: f64 = 0.7;

/// A surface that is met, near by taken for a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// In world space.
    pub point_world: DVec3,
    /// Unit length, along the ground, towards who met it.
    pub normal_world: DVec3,
}

/// At most one question at a time.
#[derive(Debug, Default)]
pub(crate) struct Feel {
    peek: Peek,
    body_m: f64,
}

impl Feel {
    /// Asks what a body of a radius meets on its way from an eye, along a unit vector. Not while an answer is to come.
    pub fn ask(
        &mut self,
        gpu: &Gpu,
        held: &mut HeldPass,
        shown: Shown<'_>,
        (eye_world, way_world): (DVec3, DVec3),
        (body_m, near_m): (f64, f64),
    ) {
        if self.peek.is_asked() {
            return;
        }
        let world_from_eye = Rigid::look_along(eye_world, way_world);
        let camera = Pinhole::symmetric(world_from_eye, (SIDE_PX, SIDE_PX), FIELD_RAD, near_m.min(body_m / 4.0));
        self.body_m = body_m;
        self.peek.ask(gpu, held, shown, &camera);
    }

    /// What was met, once: `Some(None)` where the way is free. `None` as long as it is not known.
    pub fn take(&mut self) -> Option<Option<Wall>> {
        Some(self.peek.take()?.and_then(|seen| met(&seen, self.body_m)))
    }
}

/// The nearest surface in the way of a body.
fn met(Seen { camera, w, normal_ids }: &Seen, body_m: f64) -> Option<Wall> {
    let eye = camera.world_from_eye;
    let walls = (0..w.len()).filter(|&index| w[index] > 0.0).filter_map(|index| {
        let (x, y) = (index as u32 % SIDE_PX, index as u32 / SIDE_PX);
        let point = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w: f64::from(w[index]) };
        let point_world = camera.world_from_image(point);
        // Right, down, ahead.
        let at_eye = eye.inverse().transform_point(point_world);
        let is_in_the_way = at_eye.x.abs() <= body_m && (-body_m..BELOW_BODIES * body_m).contains(&at_eye.y);
        let normal = octahedral_normal(normal_ids[index][0]).as_dvec3();
        let along_ground = DVec3::new(normal.x, 0.0, normal.z).try_normalize()?;
        let towards = along_ground * (eye.translation - point_world).dot(along_ground).signum();
        (is_in_the_way && normal.y.abs() < WALKED_ON).then_some((at_eye.z, Wall { point_world, normal_world: towards }))
    });
    walls.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, wall)| wall)
}

/// The twin of `octahedral_normal_fine` of `shaders/wgsl/common/octahedral.wgsl`.
fn octahedral_normal(code: u32) -> Vec3 {
    let of_half = |half: u32| f32::from(half as u16 as i16) / f32::from(i16::MAX);
    let p = Vec2::new(of_half(code), of_half(code >> 16)).max(Vec2::NEG_ONE);
    let z = 1.0 - p.x.abs() - p.y.abs();
    let sign = Vec2::new(1.0_f32.copysign(p.x), 1.0_f32.copysign(p.y));
    let p = if z < 0.0 { (Vec2::ONE - Vec2::new(p.y, p.x).abs()) * sign } else { p };
    Vec3::new(p.x, p.y, z).normalize_or(Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The twin of `octahedral_code_fine`.
    fn code(normal: Vec3) -> u32 {
        let p = normal.truncate() / normal.abs().element_sum();
        let sign = Vec2::new(1.0_f32.copysign(p.x), 1.0_f32.copysign(p.y));
        let p = if normal.z < 0.0 { (Vec2::ONE - Vec2::new(p.y, p.x).abs()) * sign } else { p };
        let half = |value: f32| u32::from((value * f32::from(i16::MAX)).round() as i16 as u16);
        half(p.x) | half(p.y) << 16
    }

    /// What an eye at 1.6 m sees along -z of surfaces: depth and normal by the ray's tangents, right and down.
    fn seen(surface: impl Fn(f64, f64) -> Option<(f64, Vec3)>) -> Seen {
        let eye = Rigid::look_along(DVec3::Y * 1.6, DVec3::NEG_Z);
        let camera = Pinhole::symmetric(eye, (SIDE_PX, SIDE_PX), FIELD_RAD, 0.05);
        let tangent = |place: u32| (f64::from(place) + 0.5 - f64::from(SIDE_PX) / 2.0) / camera.focal_px;
        let pixels = (0..SIDE_PX * SIDE_PX).map(|index| surface(tangent(index % SIDE_PX), tangent(index / SIDE_PX)));
        let planes = pixels.map(|pixel| match pixel {
            Some((z_m, normal)) => (1.0 / z_m as f32, [code(normal), 0]),
            None => (0.0, [0; 2]),
        });
        let (w, normal_ids) = planes.unzip();
        Seen { camera, w, normal_ids }
    }

    const BODY_M: f64 = 0.25;

    #[test]
    fn a_wall_across_the_way_is_met_and_faces_who_met_it() {
        let wall = met(&seen(|_, _| Some((2.0, Vec3::Z))), BODY_M).expect("a wall");
        assert!((wall.point_world.z + 2.0).abs() < 1e-5 && wall.normal_world.distance(DVec3::Z) < 1e-3);
        let from_behind = met(&seen(|_, _| Some((2.0, Vec3::NEG_Z))), BODY_M).expect("one side or the other");
        assert!(from_behind.normal_world.distance(DVec3::Z) < 1e-3);
    }

    #[test]
    fn what_is_beside_above_or_underfoot_is_not_met() {
        // A floor 1.6 m below the eye, a ramp, a door's frame a metre to both sides, and a lamp overhead.
        let floor = |_: f64, down: f64| (down > 0.0).then(|| (1.6 / down, Vec3::Y));
        assert_eq!(met(&seen(floor), BODY_M), None);
        let ramp = |_: f64, _: f64| Some((1.0, Vec3::new(0.0, 0.8, 0.6)));
        assert_eq!(met(&seen(ramp), BODY_M), None);
        let frame = |right: f64, _: f64| (right.abs() > 0.5).then_some((2.0, Vec3::Z));
        assert_eq!(met(&seen(frame), BODY_M), None);
        let lamp = |_: f64, down: f64| (down < -0.2).then_some((2.0, Vec3::Z));
        assert_eq!(met(&seen(lamp), BODY_M), None);
        // But a table is, from its edge on.
        let table = |_: f64, down: f64| (down > 0.25).then_some((2.0, Vec3::Z));
        assert!(met(&seen(table), BODY_M).is_some());
    }

    #[test]
    fn normals_are_read_as_they_are_written() {
        for normal in [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::new(0.3, -0.5, -0.8).normalize()] {
            assert!(octahedral_normal(code(normal)).distance(normal) < 1e-4, "{normal}");
        }
    }
}
