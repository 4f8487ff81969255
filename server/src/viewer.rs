//! What the server knows of a viewer, and where it will be: the first input of the plan.
//!
//! A client sends its pose only while it moves, so silence means that it stands still. Positions are predicted with the
//! velocity that the client states, turns with the one that two poses imply.

use camera::Rigid;
use glam::{DQuat, DVec3};
use protocol::message::ViewSize;

/// A viewer that was silent for this long stands still, whatever velocity its last pose had. Longer than the frame time of
/// a client that draws in software (0.1 to 0.3 s), which sends one pose a frame.
const STILL_AFTER_S: f64 = 0.5;

/// Faster turns than this are jumps (a viewer that was put somewhere else), not motion to extrapolate: about twice the
/// fastest deliberate head turn.
const MAX_TURN_RAD_S: f64 = 8.0;

/// What is known of a viewer, at one end of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    /// Its output.
    pub view: ViewSize,
    /// The newest pose heard, or where the scene begins before any.
    pub world_from_eye: Rigid,
    /// Metres a second, as the client states it.
    pub velocity_world: DVec3,
    /// Axis times radians a second, from the last two poses.
    pub turn_world: DVec3,
    /// Number of the newest pose, 0 before any.
    pub pose_seq: u64,
    /// Server time when the pose was heard.
    pub heard_at_s: f64,
    /// Client time when the pose was sampled.
    pub sampled_at_s: f64,
    /// Network round trip.
    pub round_trip_s: f64,
    /// What the path to it was seen to take; `None` before the first acknowledgement.
    pub bytes_per_s: Option<f64>,
}

/// Where a viewer will be, and how fast it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// The predicted eye.
    pub world_from_eye: Rigid,
    /// Metres a second; 0 for a viewer that stands still.
    pub speed_m_s: f64,
    /// Radians a second; 0 for a viewer that does not turn.
    pub turn_rad_s: f64,
}

impl Prediction {
    /// Whether the viewer neither walks nor turns.
    pub fn is_still(&self) -> bool {
        self.speed_m_s == 0.0 && self.turn_rad_s == 0.0
    }
}

impl Viewer {
    /// A viewer at the scene's beginning.
    pub fn at_start(view: ViewSize, start_world_from_eye: Rigid, now_s: f64) -> Viewer {
        Viewer {
            view,
            world_from_eye: start_world_from_eye,
            velocity_world: DVec3::ZERO,
            turn_world: DVec3::ZERO,
            pose_seq: 0,
            heard_at_s: now_s,
            sampled_at_s: f64::NEG_INFINITY,
            round_trip_s: 0.0,
            bytes_per_s: None,
        }
    }

    /// Takes in a pose; the newest number wins.
    pub fn hear(&mut self, seq: u64, sampled_at_s: f64, world_from_eye: Rigid, velocity_world: DVec3, now_s: f64) {
        if seq <= self.pose_seq {
            return;
        }
        let step_s = sampled_at_s - self.sampled_at_s;
        self.turn_world = if step_s > 0.0 && step_s < STILL_AFTER_S {
            turn_between(self.world_from_eye.rotation, world_from_eye.rotation) / step_s
        } else {
            DVec3::ZERO
        };
        if self.turn_world.length() > MAX_TURN_RAD_S {
            self.turn_world = DVec3::ZERO;
        }
        self.world_from_eye = world_from_eye;
        self.velocity_world = if velocity_world.is_finite() { velocity_world } else { DVec3::ZERO };
        self.pose_seq = seq;
        self.heard_at_s = now_s;
        self.sampled_at_s = sampled_at_s;
    }

    /// Where the viewer will be in the middle of the time for which an update made `now_s` is shown: the pose was half a
    /// round trip old when it was heard, the update takes the other half, and is then shown for an interval. No further
    /// than `max_step_m` from the last pose.
    pub fn predict(&self, now_s: f64, update_interval_s: f64, max_step_m: f64) -> Prediction {
        let silent_s = (now_s - self.heard_at_s).max(0.0);
        if silent_s > STILL_AFTER_S {
            return Prediction { world_from_eye: self.world_from_eye, speed_m_s: 0.0, turn_rad_s: 0.0 };
        }
        let ahead_s = self.round_trip_s + silent_s.min(update_interval_s) + update_interval_s / 2.0;
        let step = (self.velocity_world * ahead_s).clamp_length_max(max_step_m);
        let turn = (self.turn_world * ahead_s).clamp_length_max(MAX_PREDICTED_TURN_RAD);
        Prediction {
            world_from_eye: Rigid {
                rotation: (DQuat::from_scaled_axis(turn) * self.world_from_eye.rotation).normalize(),
                translation: self.world_from_eye.translation + step,
            },
            speed_m_s: self.velocity_world.length(),
            turn_rad_s: self.turn_world.length(),
        }
    }
}

/// Extrapolating a turn further than this is a guess: heads turn by less than half a radian in one go.
const MAX_PREDICTED_TURN_RAD: f64 = 0.5;

/// The shortest turn from one orientation to another: axis times angle, in world space.
fn turn_between(world_from_a: DQuat, world_from_b: DQuat) -> DVec3 {
    let turn = (world_from_b * world_from_a.conjugate()).normalize();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.to_scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };

    fn walker() -> Viewer {
        let mut viewer = Viewer::at_start(VIEW, Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), 0.0);
        viewer.round_trip_s = 0.1;
        let pose = Rigid::look_along(DVec3::new(1.0, 0.0, 0.0), DVec3::NEG_Z);
        viewer.hear(1, 5.0, pose, DVec3::new(2.0, 0.0, 0.0), 1.0);
        viewer
    }

    #[test]
    fn a_walker_is_expected_ahead_by_the_round_trip_and_half_an_interval() {
        let predicted = walker().predict(1.0, 0.2, 10.0);
        assert!((predicted.world_from_eye.translation - DVec3::new(1.0 + 2.0 * 0.2, 0.0, 0.0)).length() < 1e-12);
        assert!((predicted.speed_m_s - 2.0).abs() < 1e-12);
    }

    #[test]
    fn prediction_is_clamped_and_silence_means_standing_still() {
        let far = walker().predict(1.0, 0.2, 0.1).world_from_eye.translation.x;
        assert!((far - 1.1).abs() < 1e-12);
        let later = walker().predict(1.0 + STILL_AFTER_S + 0.01, 0.2, 10.0);
        assert!(later.is_still());
        assert_eq!(later.world_from_eye.translation, DVec3::X);
    }

    #[test]
    fn a_steady_turn_goes_on_and_an_old_pose_is_ignored() {
        let mut viewer = walker();
        let turned =
            Rigid { rotation: DQuat::from_rotation_y(0.1) * viewer.world_from_eye.rotation, ..viewer.world_from_eye };
        viewer.hear(2, 5.1, turned, DVec3::ZERO, 1.1);
        let predicted = viewer.predict(1.1, 0.1, 10.0);
        let angle = predicted.world_from_eye.rotation.angle_between(turned.rotation);
        assert!((angle - 1.0 * (0.1 + 0.05)).abs() < 1e-9, "{angle}");
        let before = viewer;
        viewer.hear(1, 9.0, Rigid::IDENTITY, DVec3::ONE, 2.0);
        assert_eq!(viewer, before);
    }
}
