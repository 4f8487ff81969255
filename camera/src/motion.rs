use glam::{DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::Rigid;

/// How an eye moves from a pose on: what a client says, and what both ends predict by.
///
/// Speeds are those at the pose, and are even unless they fade. A view turns about its own axis all the while; a path is a line, or an arc
/// that turns as the view does (a constant twist): who turns an object, or walks round a corner while looking along the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Metres a second.
    pub velocity_world: Vec3,
    /// Axis times radians a second of the view.
    pub turn_world: Vec3,
    /// How the path goes on.
    pub path: Path,
    /// All speeds fall to a share of `1/e` in each of these times, in seconds: a flick, or keys that were let go. `None` where they stay.
    pub fades_in_s: Option<f32>,
}

/// Which way an eye's path goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Path {
    /// Straight on.
    Line,
    /// Along an arc, with the turn of the view.
    Arc,
}

impl Motion {
    /// Standing still.
    pub const STILL: Motion =
        Motion { velocity_world: Vec3::ZERO, turn_world: Vec3::ZERO, path: Path::Line, fades_in_s: None };
    /// No speed is larger, in metres a second: of a view that spans a planet, about what crosses it in a second.
    pub const MAX_SPEED_M_S: f32 = 1e7;
    /// No turn is faster, in radians a second: sixteen times round.
    pub const MAX_TURN_RAD_S: f32 = 100.0;

    /// Along a line, without a turn.
    pub fn along(velocity_world: DVec3) -> Motion {
        Motion { velocity_world: velocity_world.as_vec3(), ..Motion::STILL }
    }

    /// About a point, from an eye, with a view that turns along: axis times radians a second.
    pub fn about(pivot_world: DVec3, eye_world: DVec3, turn_world: DVec3) -> Motion {
        Motion {
            velocity_world: turn_world.cross(eye_world - pivot_world).as_vec3(),
            turn_world: turn_world.as_vec3(),
            path: Path::Arc,
            fades_in_s: None,
        }
    }

    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.velocity_world == Vec3::ZERO && self.turn_world == Vec3::ZERO
    }

    /// Whether every number is finite and within its cap: bytes from outside may hold anything.
    pub fn is_valid(&self) -> bool {
        let within = |of: Vec3, cap: f32| of.is_finite() && of.length() <= cap;
        within(self.velocity_world, Motion::MAX_SPEED_M_S)
            && within(self.turn_world, Motion::MAX_TURN_RAD_S)
            && self.fades_in_s.is_none_or(|fade_s| fade_s.is_finite() && fade_s > 0.0)
    }

    /// Metres a second after some time.
    pub fn speed_m_s(&self, after_s: f64) -> f64 {
        self.velocity_world.as_dvec3().length() * self.left(after_s)
    }

    /// Radians a second after some time.
    pub fn turn_rad_s(&self, after_s: f64) -> f64 {
        self.turn_world.as_dvec3().length() * self.left(after_s)
    }

    /// The point that an eye on an arc turns about; `None` on a line, and where the path does not bend.
    pub fn pivot_world(&self, eye_world: DVec3) -> Option<DVec3> {
        let (velocity, turn) = (self.velocity_world.as_dvec3(), self.turn_world.as_dvec3());
        let to_pivot = turn.cross(velocity) / turn.length_squared();
        (self.path == Path::Arc && to_pivot.is_finite() && to_pivot != DVec3::ZERO).then_some(eye_world + to_pivot)
    }

    /// Where an eye that is at a pose now will be after some time, in seconds; exact on lines and on arcs.
    pub fn pose_after(&self, world_from_eye: &Rigid, after_s: f64) -> Rigid {
        let even_s = self.even_s(after_s);
        let (velocity, turn) = (self.velocity_world.as_dvec3(), self.turn_world.as_dvec3() * even_s);
        let way = match self.path {
            Path::Line => velocity * even_s,
            Path::Arc => along_arc(velocity * even_s, turn),
        };
        Rigid {
            rotation: (DQuat::from_scaled_axis(turn) * world_from_eye.rotation).normalize(),
            translation: world_from_eye.translation + way,
        }
    }

    /// The time in which the speeds at the pose would lead as far.
    fn even_s(&self, after_s: f64) -> f64 {
        self.fades_in_s.map_or(after_s, |fade_s| -f64::from(fade_s) * (-after_s / f64::from(fade_s)).exp_m1())
    }

    /// The share of the speeds that is left after some time.
    fn left(&self, after_s: f64) -> f64 {
        self.fades_in_s.map_or(1.0, |fade_s| (-after_s / f64::from(fade_s)).exp())
    }
}

impl Default for Motion {
    fn default() -> Motion {
        Motion::STILL
    }
}

/// Where a path of a length leads that begins along `straight` and turns by `turn` (axis times angle) on its way: the integral of the
/// turned direction.
fn along_arc(straight: DVec3, turn: DVec3) -> DVec3 {
    let angle = turn.length();
    if angle == 0.0 {
        return straight;
    }
    let axis = turn / angle;
    let along_axis = axis * axis.dot(straight);
    let half = (angle / 2.0).sin();
    along_axis + (straight - along_axis) * (angle.sin() / angle) + axis.cross(straight) * (2.0 * half * half / angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motion in small straight steps: the view turns, and with it the direction of an arc.
    fn in_steps(motion: &Motion, begin: &Rigid, for_s: f64) -> Rigid {
        const STEPS: u32 = 20_000;
        let step_s = for_s / f64::from(STEPS);
        let mut pose = *begin;
        let mut velocity = motion.velocity_world.as_dvec3();
        let mut turn = motion.turn_world.as_dvec3();
        for _ in 0..STEPS {
            let half = DQuat::from_scaled_axis(turn * step_s / 2.0);
            let middle = if motion.path == Path::Arc { half * velocity } else { velocity };
            pose.translation += middle * step_s;
            pose.rotation = half * half * pose.rotation;
            velocity = if motion.path == Path::Arc { half * half * velocity } else { velocity };
            let left = motion.fades_in_s.map_or(1.0, |fade_s| 1.0 - step_s / f64::from(fade_s));
            (velocity, turn) = (velocity * left, turn * left);
        }
        pose
    }

    #[test]
    fn a_pose_after_some_time_is_where_small_steps_lead() {
        let begin = Rigid::look_along(DVec3::new(3.0, 1.0, -2.0), DVec3::new(1.0, -0.2, 0.4));
        let (velocity_world, turn_world) = (Vec3::new(1.0, 0.3, -2.0), Vec3::new(0.3, 2.5, -0.4));
        for path in [Path::Line, Path::Arc] {
            for fades_in_s in [None, Some(0.2)] {
                let motion = Motion { velocity_world, turn_world, path, fades_in_s };
                for for_s in [0.0, 0.03, 0.3, 2.0] {
                    let (closed, steps) = (motion.pose_after(&begin, for_s), in_steps(&motion, &begin, for_s));
                    let off_m = closed.translation.distance(steps.translation);
                    let off_rad = closed.rotation.angle_between(steps.rotation);
                    assert!(off_m < 2e-4 && off_rad < 2e-4, "{motion:?} {for_s}: {off_m} {off_rad}");
                }
            }
        }
    }

    #[test]
    fn who_turns_about_a_point_stays_as_far_from_it_and_looks_at_it() {
        let (pivot, eye) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 4.0, 8.0));
        let begin = Rigid::look_at(eye, pivot);
        let motion = Motion::about(pivot, eye, DVec3::Y * 2.5);
        let found = motion.pivot_world(eye).expect("an arc bends");
        assert!(found.distance(DVec3::new(1.0, 4.0, 3.0)) < 1e-6, "the point of the axis beside the eye: {found}");
        for step in 0..20 {
            let pose = motion.pose_after(&begin, f64::from(step) * 0.2);
            assert!((pose.translation.distance(pivot) - eye.distance(pivot)).abs() < 1e-6);
            let looked_at = pose.transform_point(DVec3::Z * eye.distance(pivot));
            assert!(looked_at.distance(pivot) < 1e-6, "{looked_at}");
        }
        assert_eq!(Motion::along(DVec3::X).pivot_world(eye), None);
        assert_eq!(Motion { path: Path::Arc, ..Motion::along(DVec3::X) }.pivot_world(eye), None, "nothing turns");
    }

    #[test]
    fn what_is_not_finite_or_too_fast_is_no_motion() {
        let walk = Motion { turn_world: Vec3::Y, fades_in_s: Some(0.1), ..Motion::along(DVec3::X) };
        assert!(walk.is_valid() && Motion::STILL.is_valid() && !walk.is_still());
        for wrong in [
            Motion { velocity_world: Vec3::new(f32::NAN, 0.0, 0.0), ..walk },
            Motion { velocity_world: Vec3::X * 2e7, ..walk },
            Motion { turn_world: Vec3::splat(f32::INFINITY), ..walk },
            Motion { turn_world: Vec3::Y * 101.0, ..walk },
            Motion { fades_in_s: Some(0.0), ..walk },
            Motion { fades_in_s: Some(f32::NAN), ..walk },
        ] {
            assert!(!wrong.is_valid(), "{wrong:?}");
        }
    }
}
