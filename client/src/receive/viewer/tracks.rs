//! Where rigid objects are between updates and just after the last one.
//!
//! An update says where objects are at one moment, some thirty times a second; pictures are drawn more often. An object goes from one pose to
//! the next, and after the last one on, by the steps that updates tell ahead. On each its way bends as it bent from the step before to this
//! one, so that even turns, lines and arcs are exact.
//!
//! What the updates tell nothing of goes straight from the pose before to the last one, and then on as it went. An object with an acceleration
//! `a` is then off by `a t (t + d) / 2` at `t` after the last of two moments `d` apart, where one that waited there would be off by its whole
//! way. Nothing goes on so faster than it went in the step before. A step many times faster than that is none: who starts from rest, or was
//! put elsewhere as a clip is when it begins again, is there at once and waits for the next update.
//!
//! Nothing goes on for longer than it was seen or told to go: what stops is told so by the next update.

use std::collections::BTreeMap;

use camera::turn_of;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use protocol::held::{NextSteps, ObjectSteps};

/// A step this many times faster than the one before it leads nowhere.
const JUMP: f64 = 8.0;

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct Tracks {
    tracks: BTreeMap<u16, Track>,
    /// The moments of the last two updates, in scene time; equal after the first.
    moments_s: (f64, f64),
}

impl Tracks {
    /// An update said where all objects are at a moment, and told the next steps of some.
    pub fn follow(&mut self, world_from_objects: &BTreeMap<u16, DAffine3>, scene_time_s: f64, next: &NextSteps) {
        self.arrive(world_from_objects, scene_time_s);
        self.tracks.values_mut().for_each(|track| track.next = None);
        for told in &next.objects {
            if let Some(track) = self.tracks.get_mut(&told.object) {
                track.told(told, f64::from(next.step_s));
            }
        }
    }

    fn arrive(&mut self, world_from_objects: &BTreeMap<u16, DAffine3>, scene_time_s: f64) {
        let (_, last_s) = self.moments_s;
        if self.tracks.is_empty() || scene_time_s < last_s {
            // The first word, or a clock that was set back: nothing was seen to move.
            self.tracks = world_from_objects.iter().map(|(&object, &pose)| (object, Track::standing(pose))).collect();
            self.moments_s = (scene_time_s, scene_time_s);
            return;
        }
        let step_s = scene_time_s - last_s;
        if step_s > 0.0 {
            self.moments_s = (last_s, scene_time_s);
        }
        for (&object, &pose) in world_from_objects {
            let track = self.tracks.entry(object).or_insert(Track::standing(pose));
            track.follow(pose, step_s);
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Tracks::default();
    }

    /// Where objects are at a moment of scene time.
    pub fn at(&self, scene_time_s: f64) -> BTreeMap<u16, DAffine3> {
        let (before_s, last_s) = self.moments_s;
        let step_s = last_s - before_s;
        let after_s = scene_time_s - last_s;
        let steps = if step_s > 0.0 { (after_s / step_s).clamp(-1.0, 1.0) } else { 0.0 };
        let place = |track: &Track| match (&track.came, &track.next) {
            (_, Some(next)) if after_s > 0.0 => next.at(&track.last, after_s),
            (Some(came), _) if after_s < 0.0 => came.at(&track.before, (after_s + step_s).max(0.0)),
            _ => track.at(steps),
        };
        self.tracks.iter().map(|(&object, track)| (object, place(track))).collect()
    }
}

/// An object's last two poses.
#[derive(Debug, Clone, Copy)]
struct Track {
    before: DAffine3,
    last: DAffine3,
    /// From one to the other.
    step: Step,
    /// How long that took; 0 of what only stood yet.
    step_s: f64,
    /// How fast it went, in metres and radians a second.
    speeds: WayAndTurn,
    /// Which share of the step's way and turn it goes on with; 0 where it was put elsewhere.
    goes_on: WayAndTurn,
    /// What was told of the way from the pose before to the last one.
    came: Option<Next>,
    /// What was told of the way after the last pose.
    next: Option<Next>,
}

/// Steps that were told ahead.
#[derive(Debug, Clone, Copy)]
struct Next {
    steps: [Step; 3],
    /// How long each takes.
    step_s: f64,
}

/// A number of a way and one of a turn.
#[derive(Debug, Clone, Copy)]
struct WayAndTurn {
    way: f64,
    turn: f64,
}

impl WayAndTurn {
    const NONE: WayAndTurn = WayAndTurn { way: 0.0, turn: 0.0 };

    fn map(self, to: impl Fn(f64) -> f64) -> WayAndTurn {
        WayAndTurn { way: to(self.way), turn: to(self.turn) }
    }
}

/// How a pose became another.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// Where the object's origin went, in metres in world space.
    way: DVec3,
    /// By how much a way as long as this one goes on bending: axis times angle in world space.
    bend: DVec3,
    /// How the object turned, axis times angle in world space; `None` where it was stretched, too: then each number of its axes changes
    /// evenly.
    turn: Option<DVec3>,
}

impl Track {
    fn standing(pose: DAffine3) -> Track {
        let (step, none) = (Step::between(&pose, &pose), WayAndTurn::NONE);
        Track { before: pose, last: pose, step, step_s: 0.0, speeds: none, goes_on: none, came: None, next: None }
    }

    fn follow(&mut self, pose: DAffine3, step_s: f64) {
        if step_s <= 0.0 {
            // The same moment, told better.
            self.last = pose;
            self.step = Step { bend: self.step.bend, ..Step::between(&self.before, &pose) };
            return;
        }
        let straight = Step::between(&self.last, &pose);
        // From the middle of the step before to the middle of this one.
        let steps = (self.step_s + step_s) / (2.0 * step_s);
        let step = Step { bend: bend(self.step.way, straight.way) / steps, ..straight };
        let speeds = step.size(&self.last, &pose).map(|size| size / step_s);
        let share = |before: f64, now: f64| match before / now {
            share if share * JUMP < 1.0 => 0.0,
            share if share < 1.0 => share,
            // Not faster than before, or neither went at all.
            _ => 1.0,
        };
        // After an update that came late nothing is known of the way between.
        let came = self.next.filter(|next| step_s <= next.told_s());
        let before = self.speeds;
        let goes_on = WayAndTurn { way: share(before.way, speeds.way), turn: share(before.turn, speeds.turn) };
        *self = Track { before: self.last, last: pose, step, step_s, speeds, goes_on, came, next: None };
    }

    fn told(&mut self, told: &ObjectSteps, step_s: f64) {
        let mut last_way = self.step.way;
        // From the middle of the last step to the middle of the first told one, and then from step to step.
        let mut apart_steps = (self.step_s + step_s) / (2.0 * step_s);
        let steps = told.steps.map(|step| {
            let way = step.way_world.as_dvec3();
            let bend = bend(last_way, way) / apart_steps;
            (last_way, apart_steps) = (way, 1.0);
            Step { way, bend, turn: Some(step.turn_world.as_dvec3()) }
        });
        self.next = Some(Next { steps, step_s });
    }

    /// Where it is some steps after the last pose: from -1 to 1.
    fn at(&self, steps: f64) -> DAffine3 {
        // It came by all of its step, or by none of it.
        let share = if steps > 0.0 { self.goes_on } else { self.goes_on.map(f64::ceil) };
        let (way, turn) = (steps * share.way, steps * share.turn);
        // From the middle of the last way to the middle of this one.
        let translation = self.last.translation + self.step.way_bent_by((1.0 + steps) / 2.0) * way;
        let matrix3 = match self.step.turn {
            Some(last_turn) => turned(last_turn * turn) * self.last.matrix3,
            None => self.last.matrix3 + (self.last.matrix3 - self.before.matrix3) * turn,
        };
        DAffine3 { matrix3, translation }
    }
}

impl Next {
    /// For how long it is told, the last step gone twice.
    fn told_s(&self) -> f64 {
        self.step_s * (self.steps.len() + 1) as f64
    }

    /// Where it is so long after the pose from which it goes: the last step goes on for as long again.
    fn at(&self, from: &DAffine3, after_s: f64) -> DAffine3 {
        let (mut at, mut steps) = (*from, after_s / self.step_s);
        let [first @ .., last] = &self.steps;
        for step in first {
            if steps < 1.0 {
                return step.from(&at, steps);
            }
            (at, steps) = (step.from(&at, 1.0), steps - 1.0);
        }
        last.from(&at, steps.min(2.0))
    }
}

fn turned(turn: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(turn))
}

impl Step {
    /// Some part of it, or more than it, from a pose.
    fn from(&self, from: &DAffine3, steps: f64) -> DAffine3 {
        // From the middle of the whole way to the middle of this part of it.
        let translation = from.translation + self.way_bent_by((steps - 1.0) / 2.0) * steps;
        let matrix3 = self.turn.map_or(from.matrix3, |turn| turned(turn * steps) * from.matrix3);
        DAffine3 { matrix3, translation }
    }

    /// The way, as it is bent so many steps on.
    fn way_bent_by(&self, steps: f64) -> DVec3 {
        DQuat::from_scaled_axis(self.bend * steps) * self.way
    }

    /// A straight one.
    fn between(before: &DAffine3, last: &DAffine3) -> Step {
        let turn = turn_of(&before.matrix3, &last.matrix3);
        Step { way: last.translation - before.translation, bend: DVec3::ZERO, turn }
    }

    /// How far the origin went in metres, and the angle or, of what was stretched, how much its axes changed.
    fn size(&self, before: &DAffine3, last: &DAffine3) -> WayAndTurn {
        let changed =
            || (last.matrix3 - before.matrix3).to_cols_array().iter().map(|number| number * number).sum::<f64>();
        WayAndTurn { way: self.way.length(), turn: self.turn.map_or_else(|| changed().sqrt(), DVec3::length) }
    }
}

/// The turn from one direction to another, axis times angle; none where one of them has no length, or it is sharper than a right angle: who
/// comes back the way he went goes on no curve.
fn bend(from: DVec3, to: DVec3) -> DVec3 {
    match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) if from.dot(to) > 0.0 => DQuat::from_rotation_arc(from, to).to_scaled_axis(),
        _ => DVec3::ZERO,
    }
}

#[cfg(test)]
mod tests;
