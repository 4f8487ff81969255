//! Where rigid objects go after an update, told with it.
//!
//! A scene knows its own motion ahead of time. What clients are told of it lets them take objects from pose to pose also after the last
//! update, where they could only guess that everything goes on as it went: a sword that hits something does not.

use std::collections::BTreeSet;

use camera::turn_of;
use glam::{DAffine3, DVec3};
use protocol::Edit;
use protocol::held::{NextSteps, ObjectPose, ObjectSteps, Step, Update};

use super::Stage;

/// A step takes half an update's interval: three lead to where the next update finds the object, and on for as long as the path's jitter may
/// keep that.
const INTERVALS: f64 = 0.5;
/// A step that goes so many times as far as the one before it and the one after it is none: a clip began again, or something was put
/// elsewhere.
const JUMP: f64 = 8.0;
/// Metres and radians: less is the rounding of composed transforms, and no jump however still it is before and after.
const LEAST: f64 = 1e-6;

impl Stage {
    /// The steps that moving objects go from an update on: of those that go anywhere, and of those that the update moves, but for those that
    /// clients move by clips. `rate` is how fast scene time goes: where it stands nothing goes anywhere.
    pub(super) fn next_steps(
        &self,
        update: &Update,
        rate: f64,
        moving: &[ObjectPose],
        by_clip: &BTreeSet<u16>,
    ) -> NextSteps {
        if rate == 0.0 || moving.iter().all(|pose| by_clip.contains(&pose.object)) {
            return NextSteps::default();
        }
        let step_s = self.rules.update_interval_s * INTERVALS * rate;
        // On the lattice, so that what stands goes nowhere.
        let places = [-1.0, 1.0, 2.0, 3.0, 4.0]
            .map(|steps| self.lattice.settled(self.scene.places(update.scene_time_s + steps * step_s)));
        let moved: BTreeSet<u16> = update.edits.iter().flat_map(moved_by).collect();
        let is_told = |pose: &&ObjectPose| !by_clip.contains(&pose.object);
        let of = |pose: &ObjectPose| {
            let [before, first, second, third, after] =
                places.each_ref().map(|places| places[usize::from(pose.object)]);
            let steps = steps(&[before, pose.world_from_object, first, second, third, after])?;
            let steps = self.lattice.settled_steps(pose.object, steps);
            let goes = steps != [Step::default(); 3] || moved.contains(&pose.object);
            goes.then_some(ObjectSteps { object: pose.object, steps })
        };
        NextSteps { step_s: step_s as f32, objects: moving.iter().filter(is_told).filter_map(of).collect() }
    }
}

fn moved_by(edit: &Edit) -> Vec<u16> {
    match edit {
        Edit::Move(poses) => poses.iter().map(|pose| pose.object).collect(),
        Edit::Shift(shifts) => shifts.iter().map(|shift| shift.object).collect(),
        _ => Vec::new(),
    }
}

/// The inner ones of the five steps between six poses; `None` where they stretch the object, too.
fn steps(poses: &[DAffine3; 6]) -> Option<[Step; 3]> {
    let ways = [0, 1, 2, 3, 4].map(|at| poses[at + 1].translation - poses[at].translation);
    let turns = [0, 1, 2, 3, 4].map(|at| turn_of(&poses[at].matrix3, &poses[at + 1].matrix3));
    let (way_m, turn_rad) = (ways.map(DVec3::length), turns.map(|turn| turn.map_or(0.0, DVec3::length)));
    let step = |at: usize| {
        let turn = turns[at]?;
        let jumps = is_jump(&way_m[at - 1..=at + 1]) || is_jump(&turn_rad[at - 1..=at + 1]);
        let step = Step { way_world: ways[at].as_vec3(), turn_world: turn.as_vec3() };
        let is_told = !jumps && step.way_world.is_finite();
        Some(if is_told { step } else { Step::default() })
    };
    Some([step(1)?, step(2)?, step(3)?])
}

/// Whether the middle one of three steps is far longer than the others.
fn is_jump(sizes: &[f64]) -> bool {
    sizes[1] > JUMP * sizes[0].max(sizes[2]).max(LEAST)
}

#[cfg(test)]
mod tests;
