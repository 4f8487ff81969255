//! The way that a viewer is expected to go, and how far ahead on it one look serves.

use camera::{Rigid, turn_between};

use super::rules::{Rules, TURN_MARGIN_RAD};
use crate::viewer::{Course, Prediction};

/// Who goes on as expected is looked for this far ahead, and not again before that is gone. What comes into view comes in strips, with a border
/// around each: three times as wide as at every thirtieth of a second they cost 39 % fewer bytes in a fast orbit of an interior and 19 % among
/// pillars, at no more error.
const AHEAD_S: f64 = 0.1;
/// From one view on the way of who turns to the next. Images overlap by far more; views twice the turn's margin apart show no less error of a fast
/// orbit, but cost a fifth more bytes.
const WAY_STEP_RAD: f64 = 3.0 * TURN_MARGIN_RAD;
/// Who is farther from his way than this share of the margin left it.
const ASIDE_MARGINS: f64 = 0.5;
/// Or looks elsewhere by more than half of what an image is wider than the view.
const ASIDE_RAD: f64 = TURN_MARGIN_RAD / 2.0;
/// Steps of an interval in which the way is followed.
const STEPS: f64 = 4.0;

/// What is expected of a viewer who is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    course: Course,
    looked_at_s: f64,
    /// How far ahead he is looked for.
    ahead_s: f64,
    /// From how many eyes, after the predicted one.
    eyes: usize,
}

impl Way {
    /// Of a viewer for whom an update is made now. Who turns so fast that a plan's images would leave a gap is looked
    /// for less far ahead, but an interval at least; in a scene that changes with time the next tick looks anyway.
    pub fn of(rules: &Rules, course: Course, now_s: f64) -> Way {
        let (interval_s, predicted) = (rules.update_interval_s, course.after(0.0));
        let most = rules.images.saturating_sub(2).max(1);
        let covered_s = most as f64 * WAY_STEP_RAD / predicted.turn_rad_s;
        let whole_ticks = (AHEAD_S / interval_s).round().min((covered_s / interval_s).floor());
        let ticks = if rules.animated { 1.0 } else { whole_ticks.max(1.0) };
        let ahead_s = ticks * interval_s;
        let steps = (predicted.turn_rad_s * ahead_s / WAY_STEP_RAD).ceil() as usize;
        let eyes = if predicted.is_still() { 0 } else { steps.clamp(1, most) };
        Way { course, looked_at_s: now_s, ahead_s, eyes }
    }

    /// From where to look for who moves, after the eye that is predicted: from the end of the way, and evenly between.
    pub fn eyes(&self) -> impl Iterator<Item = Rigid> {
        (1..=self.eyes).map(|eye| self.course.after(self.ahead_s * eye as f64 / self.eyes as f64).world_from_eye)
    }

    /// Whether the look still serves until the next tick: he is where he was expected, sooner or later as poses come, and not yet near the end.
    pub fn leads_past(&self, rules: &Rules, predicted: &Prediction, now_s: f64) -> bool {
        let interval_s = rules.update_interval_s;
        if predicted.is_still() || now_s - self.looked_at_s > self.ahead_s - interval_s / 2.0 {
            return false;
        }
        let now = &predicted.world_from_eye;
        let is_near = |eye: Rigid| {
            eye.translation.distance(now.translation) < ASIDE_MARGINS * rules.margin_m
                && turn_between(eye.rotation, now.rotation).length() < ASIDE_RAD
        };
        let step_s = interval_s / STEPS;
        let last = ((self.ahead_s - interval_s) / step_s).round() as i32;
        (-(STEPS as i32)..=last).any(|step| is_near(self.course.after(f64::from(step) * step_s).world_from_eye))
    }
}
