//! Ways to move that need no file: eight kinds around an object, or on the ground of a scene to walk in, and an orbit.
//!
//! Each goes on for ever at a constant pace, so that a viewer on it always needs new samples.

use std::f64::consts::TAU;

use camera::{Rigid, Trace};
use glam::{DQuat, DVec3};
use protocol::message::Welcome;

/// How many kinds of path there are.
pub const KINDS: usize = 8;
/// Pace of a walking person.
const WALK_M_S: f64 = 1.4;
/// A walker stays within this distance of the start, less in a small room.
const WALK_RADIUS_M: f64 = 2.0;
/// What turns quickly is looked at from all sides within 10 s.
const ORBIT_TURNS_PER_S: f64 = 0.1;

/// Where one client goes.
#[derive(Debug, Clone)]
pub enum Path {
    /// A recorded trace, forth and back, begun at an offset in seconds.
    Trace(Trace, f64),
    /// A made path.
    Made(Made),
    /// One place for ever.
    Still(Rigid),
}

/// A circle that the eye goes round, with a head that turns.
#[derive(Debug, Clone)]
pub struct Made {
    centre_world: DVec3,
    radius_m: f64,
    height_m: f64,
    turns_per_s: f64,
    phase: f64,
    /// `None` looks at the circle's middle from outside; else the eye looks along its way, turned by this swing.
    swing_rad: Option<f64>,
}

impl Path {
    /// The `index`-th client's path in a welcomed scene: kinds in turn, each client a little further on.
    pub fn made(welcome: &Welcome, index: usize) -> Path {
        let (kind, round) = (index % KINDS, index / KINDS);
        let phase = (index as f64 * 0.618).fract();
        let (min, max) = (DVec3::from(welcome.bounds_min_world), DVec3::from(welcome.bounds_max_world));
        let sign = if kind % 2 == 0 { 1.0 } else { -1.0 };
        let share = 1.0 - 0.1 * kind as f64 - 0.02 * (round % 5) as f64;
        if welcome.walk {
            let radius_m = free_radius_m(welcome) * share;
            let start = welcome.start_world_from_eye.translation;
            Path::Made(Made {
                centre_world: start,
                radius_m,
                height_m: 0.0,
                turns_per_s: sign * WALK_M_S * share / (TAU * radius_m),
                phase,
                swing_rad: Some(0.15 * kind as f64),
            })
        } else {
            let centre_world = (min + max) / 2.0;
            let start = welcome.start_world_from_eye.translation - centre_world;
            let out_m = start.length().max(1e-6);
            let height_m = out_m * (0.1 * kind as f64 - 0.3);
            Path::Made(Made {
                centre_world,
                radius_m: (out_m * out_m - height_m * height_m).sqrt(),
                height_m,
                turns_per_s: sign * 0.03 * (1.0 + share),
                phase,
                swing_rad: None,
            })
        }
    }

    /// The `index`-th client's way round what it looks at from the start: an object, or a point ahead where one walks.
    pub fn orbit(welcome: &Welcome, index: usize) -> Path {
        let start = welcome.start_world_from_eye;
        let centre_world = if welcome.walk {
            let ahead = start.transform_vector(DVec3::Z) * DVec3::new(1.0, 0.0, 1.0);
            start.translation + ahead.try_normalize().unwrap_or(DVec3::NEG_Z) * free_radius_m(welcome)
        } else {
            (DVec3::from(welcome.bounds_min_world) + DVec3::from(welcome.bounds_max_world)) / 2.0
        };
        let out = start.translation - centre_world;
        Path::Made(Made {
            centre_world,
            radius_m: out.x.hypot(out.z).max(1e-6),
            height_m: out.y,
            turns_per_s: if index.is_multiple_of(2) { ORBIT_TURNS_PER_S } else { -ORBIT_TURNS_PER_S },
            phase: (index as f64 * 0.618).fract(),
            swing_rad: None,
        })
    }

    /// The eye at a time.
    pub fn at(&self, t_s: f64) -> Rigid {
        match self {
            Path::Trace(trace, offset_s) => {
                let length_s = trace.duration_s();
                let t_s = if length_s > 0.0 { (t_s + offset_s).rem_euclid(2.0 * length_s) } else { 0.0 };
                trace.at(if t_s > length_s { 2.0 * length_s - t_s } else { t_s })
            }
            Path::Made(made) => made.at(t_s),
            Path::Still(world_from_eye) => *world_from_eye,
        }
    }

    /// The eye's velocity in metres a second, by the path itself.
    pub fn velocity_world(&self, t_s: f64) -> DVec3 {
        const STEP_S: f64 = 0.01;
        (self.at(t_s + STEP_S).translation - self.at(t_s - STEP_S).translation) / (2.0 * STEP_S)
    }
}

/// Within this distance of the start one walks freely.
fn free_radius_m(welcome: &Welcome) -> f64 {
    let extent = DVec3::from(welcome.bounds_max_world) - DVec3::from(welcome.bounds_min_world);
    let room_m = extent.x.min(extent.z).max(0.0) / 4.0;
    WALK_RADIUS_M.min(room_m).max(0.1)
}

impl Made {
    fn at(&self, t_s: f64) -> Rigid {
        let angle = TAU * (self.turns_per_s * t_s + self.phase);
        let out = DVec3::new(angle.sin(), 0.0, angle.cos());
        let eye = self.centre_world + out * self.radius_m + DVec3::Y * self.height_m;
        match self.swing_rad {
            None => Rigid::look_at(eye, self.centre_world),
            Some(swing_rad) => {
                let along = DVec3::new(angle.cos(), 0.0, -angle.sin()) * self.turns_per_s.signum();
                let swing = DQuat::from_rotation_y(swing_rad * (TAU * t_s / 5.0).sin());
                Rigid::look_along(eye, swing * along)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::Look;
    use protocol::message::VERSION;
    use protocol::staging::SceneMotion;

    use super::*;

    fn welcome(walk: bool) -> Welcome {
        Welcome {
            version: VERSION,
            scene_name: "box".to_owned(),
            bounds_min_world: [-10.0, 0.0, -10.0],
            bounds_max_world: [10.0, 4.0, 10.0],
            start_world_from_eye: Rigid::look_along(DVec3::new(0.0, 1.7, 6.0), DVec3::new(1.0, -0.5, 0.0)),
            walk,
            near_m: 0.05,
            look: Look::Plain,
            update_interval_s: 0.05,
            scene_time_s: 0.0,
            motion: SceneMotion::Still,
            secret: 0,
            resumed: false,
        }
    }

    #[test]
    fn an_orbit_goes_round_what_the_start_looks_at() {
        let centres = [(true, DVec3::new(2.0, 1.7, 6.0), 2.0), (false, DVec3::new(0.0, 2.0, 0.0), 6.0)];
        for (walk, centre_world, radius_m) in centres {
            for index in 0..2 {
                let path = Path::orbit(&welcome(walk), index);
                for t_s in [0.0, 1.3, 7.0] {
                    let eye = path.at(t_s);
                    let ahead = eye.transform_vector(DVec3::Z);
                    let toward = centre_world - eye.translation;
                    assert!((toward.x.hypot(toward.z) - radius_m).abs() < 1e-9, "{walk}, {t_s} s: {toward}");
                    assert!(ahead.dot(toward.normalize()) > 1.0 - 1e-9, "{walk}, {t_s} s: {ahead}");
                }
                let speed_m_s = path.velocity_world(3.0).length();
                assert!((speed_m_s - TAU * radius_m * ORBIT_TURNS_PER_S).abs() < 1e-3, "{speed_m_s}");
            }
        }
    }

    #[test]
    fn who_stands_still_has_no_speed() {
        let place = Path::made(&welcome(true), 3).at(0.0);
        let path = Path::Still(place);
        assert_eq!((path.at(0.0), path.at(100.0)), (place, place));
        assert_eq!(path.velocity_world(5.0), DVec3::ZERO);
    }
}
