//! What the server knows of a viewer, and where it will be: the first input of the plan.
//!
//! A client sends its pose only while it moves, so silence means that it stands still. It says how it moves on ([`Motion`]); how far
//! off that leads is measured: one prediction at a time waits for the pose that it was made for.

use camera::{Motion, Path, Rigid, turn_between};
use glam::DVec3;
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

/// No view is predicted further round than this: past a half turn what is seen is nothing that was seen, and an error in the rate of
/// turn is as large as the view.
const MAX_PREDICTED_TURN_RAD: f64 = std::f64::consts::PI;

/// Who looks past a point by less than this turns about it: half of a view's usual width.
const FACING_RAD: f64 = 0.5;
/// A point that moved in the eye's space by more than this share of its distance is no longer what a viewer turns about.
const LEFT_SHARE: f64 = 0.25;

/// What is known of a viewer, at one end of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    /// Its output.
    pub view: ViewSize,
    /// The newest pose heard, or where the scene begins before any.
    pub world_from_eye: Rigid,
    /// How it moves on, as the client states it.
    pub motion: Motion,
    /// What it turned about last; `None` where it never did, or has left it.
    pub pivot: Option<Pivot>,
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
    /// The last pose at rest, where the motion began.
    rested: Rigid,
    /// What the path to it was seen to take; `None` before the first acknowledgement.
    pub bytes_per_s: Option<f64>,
    /// How much longer the last acknowledged update took to it than the fastest one; 0 before any.
    pub queue_s: f64,
    /// How long an update is on its way to it.
    pub one_way_s: f64,
    /// How long the path takes for an update: no two come there sooner after each other.
    pub taken_s: f64,
}

/// How far a viewer was from where it was expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionError {
    /// Metres.
    pub distance_m: f64,
    /// Radians.
    pub turn_rad: f64,
}

/// What a viewer turns about: an object, seen from all sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pivot {
    /// The point of the axis that was nearest to the eye.
    pub pivot_world: DVec3,
    /// Unit length.
    pub axis_world: DVec3,
    /// The same point in the eye's own space, where it stays.
    pivot_eye: DVec3,
}

/// A prediction in the making: from what is known at a time, on the client's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Forecast {
    made_at_s: f64,
    due_at_s: f64,
    world_from_eye: Rigid,
    motion: Motion,
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
    /// Whether the view turns along with the path.
    pub is_on_arc: bool,
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
            motion: Motion::STILL,
            pivot: None,
            pose_seq: 0,
            heard_at_s: now_s,
            sampled_at_s: f64::NEG_INFINITY,
            round_trip_s: 0.0,
            error: None,
            forecast: None,
            rested: start_world_from_eye,
            bytes_per_s: None,
            queue_s: 0.0,
            one_way_s: 0.0,
            taken_s: 0.0,
        }
    }

    /// Whether the last update waited for hardly anything: less than half of what an update takes anyway.
    pub fn has_clear_path(&self, update_interval_s: f64) -> bool {
        self.queue_s < self.round_trip_s.max(update_interval_s) / 2.0
    }

    /// Takes in a pose; the newest number wins.
    pub fn hear(&mut self, seq: u64, sampled_at_s: f64, world_from_eye: Rigid, motion: Motion, now_s: f64) {
        if seq <= self.pose_seq {
            return;
        }
        self.world_from_eye = world_from_eye;
        self.motion = if motion.is_valid() { motion } else { Motion::STILL };
        if self.motion.is_still() {
            self.rested = world_from_eye;
        } else {
            self.pivot = self.pivot_after();
        }
        self.pose_seq = seq;
        self.heard_at_s = now_s;
        self.sampled_at_s = sampled_at_s;
        if self.forecast.is_none_or(|forecast| sampled_at_s >= forecast.due_at_s) {
            self.judge();
            self.forecast = Some(Forecast {
                made_at_s: sampled_at_s,
                due_at_s: sampled_at_s + self.round_trip_s + JUDGED_AHEAD_S,
                world_from_eye: self.world_from_eye,
                motion: self.motion,
            });
        }
    }

    /// What a viewer who moves turns about: a point that he faces, for as long as it stays where it is in the eye's own space. Who walks round a
    /// corner turns about a point beside him.
    fn pivot_after(&self) -> Option<Pivot> {
        let eye_from_world = self.world_from_eye.inverse();
        if let Some(pivot_world) = self.motion.pivot_world(self.world_from_eye.translation) {
            let axis_world = self.motion.turn_world.as_dvec3().normalize();
            let forward = self.world_from_eye.transform_vector(DVec3::Z).reject_from_normalized(axis_world);
            let faces = forward.angle_between(pivot_world - self.world_from_eye.translation) < FACING_RAD;
            let pivot_eye = eye_from_world.transform_point(pivot_world);
            return faces.then_some(Pivot { pivot_world, axis_world, pivot_eye });
        }
        self.pivot.filter(|pivot| {
            let now_eye = eye_from_world.transform_point(pivot.pivot_world);
            now_eye.distance(pivot.pivot_eye) < LEFT_SHARE * pivot.pivot_eye.length()
        })
    }

    /// Lays the forecast that is due beside the newest pose. One that is long overdue was of a viewer who then stood still.
    fn judge(&mut self) {
        let Some(forecast) = self.forecast else { return };
        let ahead_s = self.sampled_at_s - forecast.made_at_s;
        let way_m = self.world_from_eye.translation.distance(forecast.world_from_eye.translation);
        let fastest_m_s = self.motion.speed_m_s(0.0) + forecast.motion.speed_m_s(0.0);
        if ahead_s > 2.0 * (forecast.due_at_s - forecast.made_at_s) || way_m > JUMP * fastest_m_s * ahead_s {
            return;
        }
        let expected = forecast.motion.pose_after(&forecast.world_from_eye, ahead_s);
        let distance_m = expected.translation.distance(self.world_from_eye.translation);
        let turn_rad = turn_between(expected.rotation, self.world_from_eye.rotation).length();
        let kept = 0.5_f64.powf(ahead_s / ERROR_HALF_LIFE_S);
        let old = self.error.unwrap_or(PredictionError { distance_m: 0.0, turn_rad: 0.0 });
        self.error = Some(PredictionError {
            distance_m: distance_m.max(kept * old.distance_m),
            turn_rad: turn_rad.max(kept * old.turn_rad),
        });
    }

    /// For how long the viewer has stood still, in seconds; 0 while it moves.
    pub fn rested_s(&self, now_s: f64) -> f64 {
        (now_s - self.heard_at_s - if self.motion.is_still() { 0.0 } else { STILL_AFTER_S }).max(0.0)
    }

    /// How far off a prediction may be: as far as lately or, where none was judged yet, as a start leads that goes on as it began.
    pub fn expected_error(&self, predicted: &Prediction) -> PredictionError {
        self.error.unwrap_or_else(|| {
            let (now, there) = (&self.world_from_eye, &predicted.world_from_eye);
            let way_m = |a: &Rigid, b: &Rigid| a.translation.distance(b.translation);
            let turn_rad = |a: &Rigid, b: &Rigid| turn_between(a.rotation, b.rotation).length();
            PredictionError {
                distance_m: gained(way_m(&self.rested, now), way_m(now, there)),
                turn_rad: gained(turn_rad(&self.rested, now), turn_rad(now, there)),
            }
        })
    }

    /// Where the viewer will be in the middle of the time for which an update made `now_s` is shown, and `further_s` later; see
    /// [`Viewer::course`].
    pub fn predict(&self, now_s: f64, update_interval_s: f64, further_s: f64, max_step_m: f64) -> Prediction {
        self.course(now_s, update_interval_s, max_step_m).after(further_s)
    }

    /// How the viewer moves on from the middle of the time for which an update made `now_s` is shown: the pose was
    /// half a round trip old when it was heard, the update takes the other half, and is then shown for an interval. Along a line no
    /// further than `max_step_m` from the last pose, unless predictions lately came true: somebody may have been put there. An arc takes
    /// three poses to be told, and is followed as far as it leads.
    pub fn course(&self, now_s: f64, update_interval_s: f64, max_step_m: f64) -> Course {
        let silent_s = (now_s - self.heard_at_s).max(0.0);
        let motion = if silent_s > STILL_AFTER_S { Motion::STILL } else { self.motion };
        let is_trusted = motion.path == Path::Arc || self.error.is_some_and(|error| error.distance_m < max_step_m);
        let farthest_m = if is_trusted { f64::INFINITY } else { max_step_m };
        Course {
            world_from_eye: self.world_from_eye,
            motion,
            ahead_s: self.round_trip_s + silent_s.min(update_interval_s) + update_interval_s / 2.0,
            reach_s: (farthest_m / motion.speed_m_s(0.0)).min(MAX_PREDICTED_TURN_RAD / motion.turn_rad_s(0.0)),
        }
    }
}

/// How a viewer is expected to move on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// The last pose that was heard, and the motion there.
    world_from_eye: Rigid,
    motion: Motion,
    /// After that pose, the time for which is predicted.
    ahead_s: f64,
    /// And the time up to which anything is.
    reach_s: f64,
}

impl Course {
    /// Where that leads, so long after the time for which is predicted.
    pub fn after(&self, further_s: f64) -> Prediction {
        let Course { world_from_eye, motion, .. } = self;
        if motion.is_still() {
            return Prediction { world_from_eye: *world_from_eye, speed_m_s: 0.0, turn_rad_s: 0.0, is_on_arc: false };
        }
        let ahead_s = (self.ahead_s + further_s).min(self.reach_s);
        Prediction {
            world_from_eye: motion.pose_after(world_from_eye, ahead_s),
            speed_m_s: motion.speed_m_s(ahead_s),
            turn_rad_s: motion.turn_rad_s(ahead_s),
            is_on_arc: motion.path == Path::Arc,
        }
    }
}

/// How much farther than `ahead` somebody comes whose speed goes on growing evenly, as it did from rest on a way of `gone`: after a time `s` at
/// an acceleration `a`, `gone` is `a s²/2`, `ahead` is `a s t`, and what growth adds to it is `a t²/2`. Infinite
/// where a key says a speed that led nowhere yet: the plan caps it.
fn gained(gone: f64, ahead: f64) -> f64 {
    if ahead > 0.0 { ahead * ahead / (4.0 * gone) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec2, Vec3};

    use super::*;

    const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };

    fn walker() -> Viewer {
        let mut viewer = Viewer::at_start(VIEW, Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), 0.0);
        viewer.round_trip_s = 0.1;
        let pose = Rigid::look_along(DVec3::new(1.0, 0.0, 0.0), DVec3::NEG_Z);
        viewer.hear(1, 5.0, pose, Motion::along(DVec3::new(2.0, 0.0, 0.0)), 1.0);
        viewer
    }

    #[test]
    fn a_walker_is_expected_ahead_by_the_round_trip_and_half_an_interval() {
        let predicted = walker().predict(1.0, 0.2, 0.0, 10.0);
        assert!((predicted.world_from_eye.translation - DVec3::new(1.0 + 2.0 * 0.2, 0.0, 0.0)).length() < 1e-12);
        assert!((predicted.speed_m_s - 2.0).abs() < 1e-12);
    }

    #[test]
    fn prediction_is_clamped_and_silence_means_standing_still() {
        let far = walker().predict(1.0, 0.2, 0.0, 0.1).world_from_eye.translation.x;
        assert!((far - 1.1).abs() < 1e-12);
        let later = walker().predict(1.0 + STILL_AFTER_S + 0.01, 0.2, 0.0, 10.0);
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
                viewer.hear(
                    first + u64::from(step as u32),
                    10.0 * first as f64 + t_s,
                    pose,
                    Motion::along(velocity),
                    2.0,
                );
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
    fn an_orbit_is_followed_along_its_arc_and_hardly_errs() {
        let (rate, radius_m) = (144_f64.to_radians(), 5.0);
        let at = |t_s: f64| {
            let angle = rate * t_s;
            Rigid::look_at(DVec3::new(angle.sin(), 0.2, angle.cos()) * radius_m, DVec3::Y)
        };
        let mut viewer = walker();
        for step in 0..60_u32 {
            let t_s = f64::from(step) / 60.0;
            let motion = Motion::about(DVec3::ZERO, at(t_s).translation, DVec3::Y * rate);
            viewer.hear(2 + u64::from(step), 100.0 + t_s, at(t_s), motion, 100.05 + t_s);
        }
        let heard_s = 59.0 / 60.0;
        let predicted = viewer.predict(100.05 + heard_s, 0.1, 0.1, 0.5).world_from_eye;
        let truth = at(heard_s + 0.1 + 0.05 + 0.1);
        assert!(predicted.translation.distance(truth.translation) < 1e-5, "farther than a step of 0.5 m");
        assert!(predicted.rotation.angle_between(truth.rotation) < 1e-5);
        let error = viewer.error.expect("judged");
        assert!(error.distance_m < 1e-5 && error.turn_rad < 1e-5, "{error:?}");
        let pivot = viewer.pivot.expect("it turns about a point");
        assert!(DVec2::new(pivot.pivot_world.x, pivot.pivot_world.z).length() < 1e-5 && pivot.axis_world.y > 0.999);
        viewer.hear(100, 102.0, at(1.0), Motion::STILL, 102.0);
        viewer.hear(101, 102.1, at(1.0), Motion::along(DVec3::X), 102.1);
        assert!(viewer.pivot.is_some(), "who stops, or turns it by hand, is still before it");
        let away = Rigid { translation: at(1.0).translation * 1.5, ..at(1.0) };
        viewer.hear(102, 102.2, away, Motion::along(DVec3::X), 102.2);
        assert_eq!(viewer.pivot, None, "who walks has left it");
    }

    #[test]
    fn a_start_may_go_on_growing_as_it_began() {
        let start = Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z);
        let (metres_s2, heard_s) = (12.0, 0.04);
        let mut viewer = Viewer::at_start(VIEW, start, 0.0);
        viewer.hear(1, 0.0, start, Motion::STILL, 0.0);
        let now = Rigid { translation: DVec3::X * metres_s2 * heard_s * heard_s / 2.0, ..start };
        viewer.hear(2, heard_s, now, Motion::along(DVec3::X * metres_s2 * heard_s), heard_s);
        let predicted = viewer.predict(heard_s, 0.2, 0.0, f64::INFINITY);
        let at_s = heard_s + 0.1;
        let truth_m = metres_s2 * at_s * at_s / 2.0;
        let error = viewer.expected_error(&predicted);
        assert!((predicted.world_from_eye.translation.x + error.distance_m - truth_m).abs() < 1e-6, "{error:?}");
        assert_eq!(error.turn_rad, 0.0);
        let rests = viewer.predict(heard_s + 1.0, 0.2, 0.0, f64::INFINITY);
        assert_eq!(viewer.expected_error(&rests), PredictionError { distance_m: 0.0, turn_rad: 0.0 });
    }

    #[test]
    fn a_steady_turn_goes_on_and_an_old_pose_is_ignored() {
        let mut viewer = walker();
        let turned =
            Rigid { rotation: DQuat::from_rotation_y(0.1) * viewer.world_from_eye.rotation, ..viewer.world_from_eye };
        let turn = Motion { turn_world: Vec3::Y, ..Motion::STILL };
        viewer.hear(2, 5.1, turned, turn, 1.1);
        let predicted = viewer.predict(1.1, 0.1, 0.0, 10.0);
        let angle = predicted.world_from_eye.rotation.angle_between(turned.rotation);
        assert!((angle - 1.0 * (0.1 + 0.05)).abs() < 1e-9, "{angle}");
        let before = viewer;
        viewer.hear(1, 9.0, Rigid::IDENTITY, Motion::along(DVec3::ONE), 2.0);
        assert_eq!(viewer, before);
    }
}
