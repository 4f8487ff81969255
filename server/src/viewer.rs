//! What the server knows of a viewer, and where it will be: the first input of the plan.
//!
//! A client sends its pose only while it moves, so silence means that it stands still. Positions are predicted with the
//! velocity that the client states, turns with the one that two poses imply. How far off that is, is measured: one prediction
//! at a time waits for the pose that it was made for.

use camera::Rigid;
use glam::{DQuat, DVec3};
use protocol::message::ViewSize;

/// A viewer that was silent for this long stands still, whatever velocity its last pose had. Longer than the frame time of
/// a client that draws in software (0.1 to 0.3 s), which sends one pose a frame.
const STILL_AFTER_S: f64 = 0.5;

/// How far ahead of a round trip a prediction is judged: an interval of ten updates a second.
const JUDGED_AHEAD_S: f64 = 0.1;
/// What was seen of the error counts half after this time.
const ERROR_HALF_LIFE_S: f64 = 1.0;
/// A viewer who came this many times further than its velocities, before and after, explain was put there: no error of prediction.
const JUMP: f64 = 4.0;

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
    /// How far off predictions lately were; `None` before any was judged.
    pub error: Option<PredictionError>,
    /// The prediction that will be judged next.
    forecast: Option<Forecast>,
    /// What the path to it was seen to take; `None` before the first acknowledgement.
    pub bytes_per_s: Option<f64>,
}

/// How far a viewer was from where it was expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionError {
    /// Metres.
    pub distance_m: f64,
    /// Radians.
    pub turn_rad: f64,
}

/// A prediction in the making: from what is known at a time, on the client's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Forecast {
    made_at_s: f64,
    due_at_s: f64,
    world_from_eye: Rigid,
    velocity_world: DVec3,
    turn_world: DVec3,
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
            error: None,
            forecast: None,
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
        if self.forecast.is_none_or(|forecast| sampled_at_s >= forecast.due_at_s) {
            self.judge();
            self.forecast = Some(Forecast {
                made_at_s: sampled_at_s,
                due_at_s: sampled_at_s + self.round_trip_s + JUDGED_AHEAD_S,
                world_from_eye: self.world_from_eye,
                velocity_world: self.velocity_world,
                turn_world: self.turn_world,
            });
        }
    }

    /// Lays the forecast that is due beside the newest pose. One that is long overdue was of a viewer who then stood still.
    fn judge(&mut self) {
        let Some(forecast) = self.forecast else { return };
        let ahead_s = self.sampled_at_s - forecast.made_at_s;
        let way_m = self.world_from_eye.translation.distance(forecast.world_from_eye.translation);
        let fastest_m_s = self.velocity_world.length() + forecast.velocity_world.length();
        if ahead_s > 2.0 * (forecast.due_at_s - forecast.made_at_s) || way_m > JUMP * fastest_m_s * ahead_s {
            return;
        }
        let expected = forecast.world_from_eye.translation + forecast.velocity_world * ahead_s;
        let rotation = DQuat::from_scaled_axis(forecast.turn_world * ahead_s) * forecast.world_from_eye.rotation;
        let distance_m = expected.distance(self.world_from_eye.translation);
        let turn_rad = turn_between(rotation.normalize(), self.world_from_eye.rotation).length();
        let kept = 0.5_f64.powf(ahead_s / ERROR_HALF_LIFE_S);
        let old = self.error.unwrap_or(PredictionError { distance_m: 0.0, turn_rad: 0.0 });
        self.error = Some(PredictionError {
            distance_m: distance_m.max(kept * old.distance_m),
            turn_rad: turn_rad.max(kept * old.turn_rad),
        });
    }

    /// For how long the viewer has stood still, in seconds; 0 while it moves.
    pub fn rested_s(&self, now_s: f64) -> f64 {
        let stopped = self.velocity_world == DVec3::ZERO && self.turn_world == DVec3::ZERO;
        (now_s - self.heard_at_s - if stopped { 0.0 } else { STILL_AFTER_S }).max(0.0)
    }

    /// How far off a prediction may be: as far as lately, or as far as the viewer comes in a round trip where none was judged yet.
    pub fn expected_error(&self, predicted: &Prediction) -> PredictionError {
        self.error.unwrap_or(PredictionError {
            distance_m: predicted.speed_m_s * self.round_trip_s,
            turn_rad: predicted.turn_rad_s * self.round_trip_s,
        })
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
    fn the_error_of_prediction_is_measured() {
        let mut viewer = walker();
        let walk = |viewer: &mut Viewer, first: u64, x: &dyn Fn(f64) -> f64, speed: &dyn Fn(f64) -> f64| {
            for step in 0..20 {
                let t_s = f64::from(step) * 0.05;
                let pose = Rigid::look_along(DVec3::new(x(t_s), 0.0, 0.0), DVec3::NEG_Z);
                let velocity = DVec3::new(speed(t_s), 0.0, 0.0);
                viewer.hear(first + u64::from(step as u32), 10.0 * first as f64 + t_s, pose, velocity, 2.0);
            }
            viewer.error.map(|error| error.distance_m)
        };
        let steady_m = walk(&mut viewer, 2, &|t_s| 2.0 * t_s, &|_| 2.0).expect("judged");
        assert!(steady_m < 1e-9, "{steady_m}");
        // Back and forth: what a turn at 2 m/s costs a prediction of 0.2 s.
        let zigzag = |t_s: f64| 2.0 * (t_s - 0.5).abs();
        let turned_m = walk(&mut viewer, 100, &zigzag, &|t_s| if t_s < 0.5 { -2.0 } else { 2.0 }).expect("judged");
        assert!((0.2..=0.8).contains(&turned_m), "{turned_m}");
        let jumped = |t_s: f64| if t_s < 0.5 { 0.0 } else { 1000.0 };
        let after_m = walk(&mut viewer, 200, &jumped, &|_| 0.1).expect("judged");
        assert!(after_m < turned_m, "who is put elsewhere is no error: {after_m}");
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
