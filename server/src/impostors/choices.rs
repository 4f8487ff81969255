//! What was chosen for the reflectors that a viewer sees, and for how long it holds.

use std::collections::BTreeMap;

use glam::DVec3;

use super::choice::Choice;
use super::group::Ball;
use super::reflector::Reflector;

/// A choice is made anew where the reflector is this many of its radii from where it was made: then other things are near it.
const HOLDS_RADII: f64 = 4.0;
/// Or where the viewer has gone round it by this angle, and so sees other things in it.
const HOLDS_RAD: f64 = 0.5;
/// Or, where anything moves, after this time: what is chosen costs bytes for as long as it is followed, and choosing costs time.
const HOLDS_S: f64 = 20.0;

/// The choices of a viewer's reflectors.
#[derive(Debug, Clone, Default)]
pub struct Choices {
    made: BTreeMap<u16, Made>,
}

#[derive(Debug, Clone)]
struct Made {
    choice: Choice,
    ball: Ball,
    eye_world: DVec3,
    time_s: f64,
}

impl Choices {
    /// What was chosen for a reflector; `None` where nothing was yet.
    pub(super) fn of(&self, reflector: &Reflector<'_>) -> Option<&Choice> {
        self.made.get(&reflector.id).map(|made| &made.choice)
    }

    /// Whether what was chosen still holds where the reflector and the viewer are now.
    pub(super) fn holds(&self, reflector: &Reflector<'_>, eye_world: DVec3) -> bool {
        self.made.get(&reflector.id).is_some_and(|made| {
            let moved_m = made.ball.centre.distance(reflector.ball.centre);
            let is_recent = (reflector.snapshot.time_s - made.time_s).abs() < HOLDS_S;
            let [was, is] =
                [(made.eye_world, made.ball), (eye_world, reflector.ball)].map(|(eye, ball)| eye - ball.centre);
            let turned_rad = was.angle_between(is);
            (turned_rad.is_nan() || turned_rad <= HOLDS_RAD)
                && moved_m <= HOLDS_RADII * made.ball.radius_m
                && (is_recent || !reflector.scene.is_animated())
        })
    }

    pub(super) fn insert(&mut self, reflector: &Reflector<'_>, eye_world: DVec3, choice: Choice) {
        let made = Made { choice, ball: reflector.ball, eye_world, time_s: reflector.snapshot.time_s };
        self.made.insert(reflector.id, made);
    }
}
