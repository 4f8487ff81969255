//! Eight ways to move that need no file: around an object, or on the ground of a scene to walk in.
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

/// Where one client goes.
#[derive(Debug, Clone)]
pub enum Path {
    /// A recorded trace, forth and back, begun at an offset in seconds.
    Trace(Trace, f64),
    /// A made path.
    Made(Made),
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
            let extent = max - min;
            let room_m = extent.x.min(extent.z).max(0.0) / 4.0;
            let radius_m = WALK_RADIUS_M.min(room_m).max(0.1) * share;
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

    /// The eye at a time.
    pub fn at(&self, t_s: f64) -> Rigid {
        match self {
            Path::Trace(trace, offset_s) => {
                let length_s = trace.duration_s();
                let t_s = if length_s > 0.0 { (t_s + offset_s).rem_euclid(2.0 * length_s) } else { 0.0 };
                trace.at(if t_s > length_s { 2.0 * length_s - t_s } else { t_s })
            }
            Path::Made(made) => made.at(t_s),
        }
    }

    /// The eye's velocity in metres a second, by the path itself.
    pub fn velocity_world(&self, t_s: f64) -> DVec3 {
        const STEP_S: f64 = 0.01;
        (self.at(t_s + STEP_S).translation - self.at(t_s - STEP_S).translation) / (2.0 * STEP_S)
    }
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
