//! How an eye moves, from its last poses: for traces, and for all that no key says.
//!
//! A line and an even turn are fitted to a tenth of a second by least squares. Who turns about a point is told by geometry alone: that
//! point stays where it is in the eye's own space at every pose, however irregular in time the steps of a mouse are. A speed that falls
//! exponentially, as friction has it, or grew evenly from rest, as a hand begins, is taken for that where it fits clearly better than an
//! even one.

use std::collections::VecDeque;

use camera::{Motion, Path, Rigid, turn_between};
use glam::{DMat3, DQuat, DVec3};

/// A pose older than this says nothing about the motion now: longer than a frame of a client that draws in software.
const WITHIN_S: f64 = 0.5;
/// Poses of so long are fitted: seven frames, in which a mouse has made steps enough, and a person has hardly changed his mind.
const WINDOW_S: f64 = 0.12;
/// So many are taken even where they are older: the least that tell an arc from a line.
const LEAST_POSES: usize = 3;
/// A step this many times faster than any before it is no motion: somebody was put elsewhere.
const JUMP: f64 = 8.0;
/// A view that turns faster than this was turned by nobody: twice the fastest flick of a hand.
const FASTEST_TURN_RAD_S: f64 = 30.0;
/// Between two frames no motion changes its speed this many times, but the steps of a mouse do.
const UNEVEN: f64 = 2.0;
/// A hand with a mouse that did not move it for so long has stopped: three frames.
const PAUSE_S: f64 = 0.045;
/// A model with one more number must leave at most this share of the error, or noise would choose it.
const CLEARLY: f64 = 0.5;
/// Poses that a falling speed is seen in at least.
const LEAST_TO_FADE: usize = 4;
/// And one that grows from rest: the first of them is at rest.
const LEAST_TO_GROW: usize = 3;
/// Times in which speeds fall to a share of 1/e, in seconds, from keys that are let go to a flick that runs out slowly.
const FADES_S: [f64; 9] = [0.04, 0.06, 0.08, 0.12, 0.16, 0.24, 0.32, 0.5, 0.8];
/// For how long a motion grew from rest, in seconds: up to the window.
const GROWTHS_S: [f64; 8] = [0.015, 0.025, 0.035, 0.05, 0.065, 0.08, 0.1, 0.12];
/// For how long it has been even since, in seconds.
const EVEN_SINCE_S: [f64; 6] = [0.0, 0.015, 0.03, 0.045, 0.06, 0.08];

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct MotionEstimator {
    recent: VecDeque<Seen>,
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    at_s: f64,
    world_from_eye: Rigid,
}

impl MotionEstimator {
    /// Takes in where the eye is at a time, and says how it moves. Call it once a frame, moved or not.
    pub fn see(&mut self, world_from_eye: Rigid, at_s: f64) -> Motion {
        self.recent.retain(|seen| seen.at_s < at_s && at_s - seen.at_s < WITHIN_S);
        let jumped = self.is_jump(&world_from_eye, at_s);
        self.recent.push_back(Seen { at_s, world_from_eye });
        if jumped || self.has_stopped() {
            // What follows begins from rest, from this pose on.
            self.recent.drain(..self.recent.len() - 1);
        }
        while self.recent.len() > LEAST_POSES && at_s - self.recent[0].at_s > WINDOW_S {
            self.recent.pop_front();
        }
        let motion = if self.recent.len() < 2 { Motion::STILL } else { fitted(&Steps::new(&self.recent)) };
        if motion.is_valid() { motion } else { Motion::STILL }
    }

    /// Whether the eye came here by no motion.
    fn is_jump(&self, world_from_eye: &Rigid, at_s: f64) -> bool {
        let Some(last) = self.recent.back() else { return false };
        let (speed_m_s, turn_rad_s) = speeds(last, &Seen { at_s, world_from_eye: *world_from_eye });
        let before = self.recent.iter().zip(self.recent.iter().skip(1)).map(|(a, b)| speeds(a, b).0);
        let fastest_m_s = before.fold(0.0, f64::max);
        turn_rad_s > FASTEST_TURN_RAD_S || (fastest_m_s > 0.0 && speed_m_s > JUMP * fastest_m_s)
    }

    /// Whether the pose stays: at once for who moved evenly, and only after a pause for a hand with a mouse, whose steps are uneven.
    fn has_stopped(&self) -> bool {
        let Some(now) = self.recent.back() else { return false };
        let same = self.recent.iter().rev().take_while(|seen| seen.world_from_eye == now.world_from_eye);
        let (count, since_s) = same.fold((0, now.at_s), |(count, _), seen| (count + 1, seen.at_s));
        let moving = self.recent.len() - count + 1;
        let steps = self.recent.iter().zip(self.recent.iter().skip(1)).take(moving - 1).map(|(a, b)| speeds(a, b));
        let (ways, turns): (Vec<f64>, Vec<f64>) = steps.unzip();
        let is_uneven = |speeds: &[f64]| {
            let (least, most) =
                speeds.iter().fold((f64::INFINITY, 0.0), |(low, high), &it| (it.min(low), it.max(high)));
            most > UNEVEN * least
        };
        let pause_s = if is_uneven(&ways) || is_uneven(&turns) { PAUSE_S } else { 0.0 };
        count > 1 && now.at_s - since_s >= pause_s
    }
}

/// Metres and radians a second between two poses.
fn speeds(a: &Seen, b: &Seen) -> (f64, f64) {
    let step_s = b.at_s - a.at_s;
    let way_m = a.world_from_eye.translation.distance(b.world_from_eye.translation);
    (way_m / step_s, turn_between(a.world_from_eye.rotation, b.world_from_eye.rotation).length() / step_s)
}

/// Poses as seen from the newest one, which is the last.
struct Steps {
    /// Seconds, at most 0.
    at_s: Vec<f64>,
    /// Metres from the newest eye, in world space.
    away: Vec<DVec3>,
    /// Turns from the newest pose to this one, axis times angle in world space.
    turn: Vec<DVec3>,
}

impl Steps {
    fn new(recent: &VecDeque<Seen>) -> Steps {
        let newest = recent[recent.len() - 1];
        let now = newest.world_from_eye;
        Steps {
            at_s: recent.iter().map(|seen| seen.at_s - newest.at_s).collect(),
            away: recent.iter().map(|seen| seen.world_from_eye.translation - now.translation).collect(),
            turn: recent.iter().map(|seen| turn_between(now.rotation, seen.world_from_eye.rotation)).collect(),
        }
    }
}

/// The simplest motion that explains some steps.
fn fitted(steps: &Steps) -> Motion {
    let line = Line::fit(&steps.at_s, &steps.away);
    let pivot =
        (steps.at_s.len() >= LEAST_POSES).then(|| Pivot::fit(steps)).filter(|it| it.error < CLEARLY * line.error);
    // An arc and its speed are those of its turn.
    let decides = if pivot.is_some() || line.slope == DVec3::ZERO { &steps.turn } else { &steps.away };
    let change = Change::fit(&steps.at_s, decides);
    let at_s = change.even(&steps.at_s);
    let turn_world = Line::fit(&at_s, &steps.turn).slope;
    let velocity_world = match &pivot {
        Some(pivot) => pivot.away.cross(turn_world),
        None => Line::fit(&at_s, &steps.away).slope,
    };
    Motion {
        velocity_world: velocity_world.as_vec3(),
        turn_world: turn_world.as_vec3(),
        path: if pivot.is_some() { Path::Arc } else { Path::Line },
        fades_in_s: change.fades_in_s(),
    }
}

/// Values that change evenly: a least-squares line.
struct Line {
    slope: DVec3,
    /// Root of the mean square by which the values are off it.
    error: f64,
}

impl Line {
    fn fit(at: &[f64], values: &[DVec3]) -> Line {
        let count = at.len() as f64;
        let (mean_at, mean) = (at.iter().sum::<f64>() / count, values.iter().sum::<DVec3>() / count);
        let pairs = || at.iter().zip(values).map(|(at, value)| (at - mean_at, value - mean));
        let spread: f64 = pairs().map(|(at, _)| at * at).sum();
        let slope = pairs().map(|(at, value)| at * value).sum::<DVec3>() / spread;
        let square: f64 = pairs().map(|(at, value)| (value - slope * at).length_squared()).sum();
        Line { slope, error: (square / count).sqrt() }
    }
}

/// A point that all poses turn about.
struct Pivot {
    /// From the newest eye, in world space.
    away: DVec3,
    /// Root of the mean square by which it does not stay where it is.
    error: f64,
}

impl Pivot {
    /// The point that is carried along with the eye and stays in the same place: `away + turned * pivot` is the same for all poses.
    fn fit(steps: &Steps) -> Pivot {
        let turned: Vec<DMat3> =
            steps.turn.iter().map(|turn| DMat3::from_quat(DQuat::from_scaled_axis(*turn))).collect();
        let count = turned.len() as f64;
        let mean = turned.iter().fold(DMat3::ZERO, |sum, turned| sum + *turned) * (1.0 / count);
        let mean_away = steps.away.iter().sum::<DVec3>() / count;
        let pairs = || turned.iter().zip(&steps.away).map(|(turned, away)| (*turned - mean, *away - mean_away));
        let normal = pairs().fold(DMat3::ZERO, |sum, (turned, _)| sum + turned.transpose() * turned);
        let right = -pairs().map(|(turned, away)| turned.transpose() * away).sum::<DVec3>();
        // Along an axis that all turns share any point does: this makes it the one nearest to the eye, and changes no other by more than
        // a millionth.
        let least = DMat3::IDENTITY * (1e-6 * (normal.x_axis.x + normal.y_axis.y + normal.z_axis.z));
        let away = (normal + least).inverse() * right;
        let square: f64 = pairs().map(|(turned, away_i)| (turned * away + away_i).length_squared()).sum();
        let error = (square / count).sqrt();
        if error.is_finite() { Pivot { away, error } } else { Pivot { away: DVec3::ZERO, error: f64::INFINITY } }
    }
}

/// How speeds change.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    None,
    /// They fall by a share of 1/e in this time, in seconds.
    Fade(f64),
    /// They grew evenly from rest, and are even since some seconds.
    Start {
        growth_s: f64,
        even_s: f64,
    },
}

impl Change {
    fn fit(at_s: &[f64], values: &[DVec3]) -> Change {
        let even = Line::fit(at_s, values).error;
        let fades = FADES_S.iter().filter(|_| at_s.len() >= LEAST_TO_FADE).map(|&s| Change::Fade(s));
        let starts = EVEN_SINCE_S.iter().flat_map(|&even_s| {
            let least = LEAST_TO_GROW + usize::from(even_s > 0.0);
            let growths = GROWTHS_S.iter().filter(move |_| at_s.len() >= least);
            growths.map(move |&growth_s| Change::Start { growth_s, even_s })
        });
        let errors = fades.chain(starts).map(|change| (change, Line::fit(&change.even(at_s), values).error));
        let best = errors.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, error)| *error < CLEARLY * even);
        best.map_or(Change::None, |(change, _)| change)
    }

    /// The times at which what moves as fast as now, but evenly, is as far.
    fn even(self, at_s: &[f64]) -> Vec<f64> {
        let even = |at_s: f64| match self {
            Change::None => at_s,
            Change::Fade(fade_s) => -fade_s * (-at_s / fade_s).exp_m1(),
            Change::Start { even_s, .. } if at_s >= -even_s => at_s,
            Change::Start { growth_s, even_s } => {
                let grown_s = (at_s + even_s + growth_s).max(0.0);
                (grown_s * grown_s / growth_s - growth_s) / 2.0 - even_s
            }
        };
        at_s.iter().map(|&at_s| even(at_s)).collect()
    }

    /// Nobody grows faster for ever: what grows is expected to stay as it is.
    fn fades_in_s(self) -> Option<f32> {
        match self {
            Change::Fade(fade_s) => Some(fade_s as f32),
            Change::None | Change::Start { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests;
