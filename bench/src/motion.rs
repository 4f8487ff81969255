//! Ways to move that need no file: what people do with their hands and feet, for any scene.
//!
//! All speeds and times stand here. A change of pace takes [`EASE_S`].
//!
//! | motion | where one turns an object | where one walks |
//! |---|---|---|
//! | **orbit** | twice round it, once in [`ORBIT_S`] (144 degrees a second) or what is asked for; each round is reported apart | the same round a point ahead |
//! | **flick** | once round it at [`SLOW_ROUND_DEG_S`] and [`PAUSE_S`] at rest; then [`FLICK_DEG_S`] for [`FLICK_S`], and [`REST_S`] at rest | the same on the spot |
//! | **walk** | past it: sideways at [`PAST_PER_S`] of the distance to its middle, looking at it, out for [`WALK_S`] and back | a line ahead at [`WALK_M_S`], out for [`WALK_S`] and back, slower where something is in the way; the head turns by [`HEAD_DEG`] to either side, at most 60 degrees a second |
//! | **turn** | once about oneself at [`TURN_DEG_S`] | the same |
//! | **rest** | round it at [`SLOW_ORBIT_DEG_S`] for [`SLOW_ORBIT_S`], then [`REST_S`] at rest | the same round a point ahead |
//!
//! An object's middle is that of its bounds. The point ahead, where one walks, is as far away as what the first view shows in its middle, at
//! most [`RING_M`], and half of it, again and again, while something stands in the way round it at the height of the eyes.

use std::f64::consts::TAU;
use std::ops::Range;

use camera::{Rigid, Trace, TracePose};
use glam::{DQuat, DVec3};
use protocol::Look;
use scene::Scene;
use server::look::SceneLook;
use server::start::start_pose;

use crate::raytrace::RayTruth;

/// Seconds of a quick round: as long as the traces of other systems that we compare with.
pub const ORBIT_S: f64 = 2.5;
/// A turn with the mouse that lets one look at what comes into view.
pub const SLOW_ROUND_DEG_S: f64 = 60.0;
/// Between a slow round and a flick.
pub const PAUSE_S: f64 = 0.5;
/// A flick of the wrist.
pub const FLICK_DEG_S: f64 = 360.0;
/// Of a flick: half a turn.
pub const FLICK_S: f64 = 0.5;
/// At the end of a flick and of a slow orbit.
pub const REST_S: f64 = 1.5;
/// A person who walks.
pub const WALK_M_S: f64 = 1.2;
/// Before the way back.
pub const WALK_S: f64 = 2.0;
/// What an unhurried walk at 3 m from an object is.
pub const PAST_PER_S: f64 = 0.4;
/// Of a walker's head, to either side.
pub const HEAD_DEG: f64 = 20.0;
/// A swing of the head there and back: its greatest speed is 60 degrees a second.
const HEAD_SWING_S: f64 = TAU * HEAD_DEG / 60.0;
/// Looking around on the spot.
pub const TURN_DEG_S: f64 = 60.0;
/// An object that is turned to be looked at.
pub const SLOW_ORBIT_DEG_S: f64 = 20.0;
/// Before one stops.
pub const SLOW_ORBIT_S: f64 = 1.5;
/// Every change of pace: a hand and a head need about as long.
pub const EASE_S: f64 = 0.1;
/// The farthest point ahead that a walker goes round.
pub const RING_M: f64 = 4.0;
/// How near to a wall a walker comes.
const ARM_M: f64 = 0.5;
/// The sides of the polygon along which the way round a point is looked at.
const RING_SIDES: u32 = 48;
/// How often the point ahead is brought nearer: below an eighth of [`RING_M`] one turns on the spot.
const RING_HALVINGS: i32 = 3;

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Motion {
    /// Twice round.
    Orbit,
    /// A slow round, then half a turn at once.
    Flick,
    /// Ahead or past, and back.
    Walk,
    /// Once about oneself.
    Turn,
    /// A slow orbit that stops.
    Rest,
}

impl Motion {
    /// All there are.
    pub const ALL: [Motion; 5] = [Motion::Orbit, Motion::Flick, Motion::Walk, Motion::Turn, Motion::Rest];

    /// What people type.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Orbit => "orbit",
            Motion::Flick => "flick",
            Motion::Walk => "walk",
            Motion::Turn => "turn",
            Motion::Rest => "rest",
        }
    }
}

/// A part of a motion that is reported on its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// For people.
    pub name: String,
    /// In seconds from the beginning.
    pub time_s: Range<f64>,
}

impl Part {
    /// Its frames at `hz` a second: those at or after its beginning, to the rounding of their times.
    pub fn frames(&self, hz: f64) -> Range<usize> {
        let first = |t_s: f64| (t_s * hz - 0.01).ceil() as usize;
        first(self.time_s.start)..first(self.time_s.end)
    }
}

/// A motion through a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// The eye.
    pub trace: Trace,
    /// In order; together all of it, or what of it is looked at.
    pub parts: Vec<Part>,
}

/// A stretch of time at one pace.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    s: f64,
    per_s: f64,
}

/// Where one is at a time along legs whose pace changes at once: the leg, how far one has come, and the sum of that over time.
fn at(legs: &[Leg], t_s: f64) -> (usize, f64, f64) {
    let (mut way, mut sum, mut left_s) = (0.0, 0.0, t_s.max(0.0));
    for (index, leg) in legs.iter().enumerate() {
        let s = left_s.min(leg.s);
        sum += way * s + leg.per_s * s * s / 2.0;
        way += leg.per_s * s;
        if left_s < leg.s {
            return (index, way, sum);
        }
        left_s -= s;
    }
    (legs.len(), way, sum + way * left_s)
}

/// How far one has come at a time along legs: the mean over the last [`EASE_S`] of the way whose pace changes at once, so that the pace
/// changes evenly, and each leg's way stays what it is.
fn gone(legs: &[Leg], t_s: f64) -> f64 {
    let (before, now) = (at(legs, t_s - EASE_S), at(legs, t_s));
    if before.0 == now.0 && t_s >= EASE_S {
        // At one pace the mean is the middle: who stands still does so to the last bit.
        return at(legs, t_s - EASE_S / 2.0).1;
    }
    (now.2 - before.2) / EASE_S
}

fn seconds(legs: &[Leg]) -> f64 {
    legs.iter().map(|leg| leg.s).sum::<f64>() + EASE_S
}

/// How long after stopping what a viewer at rest sees is looked at, beside the end.
pub const RESTS_AFTER_S: [f64; 2] = [0.5, 1.0];

/// A motion through a scene, with a pose each `1 / hz` seconds. `round_s`: what a round of an orbit takes.
pub fn way(motion: Motion, scene: &Scene, round_s: f64, hz: f64) -> Way {
    let place = Place::of(scene);
    let (legs, ends): (Vec<Leg>, Vec<(&str, f64)>) = match motion {
        Motion::Orbit => {
            // A round is over when its way is: half of the ease late.
            let ends = vec![("orbit, round 1", round_s + EASE_S / 2.0), ("orbit, round 2", f64::INFINITY)];
            (vec![Leg { s: 2.0 * round_s, per_s: 360.0 / round_s }], ends)
        }
        Motion::Flick => {
            let slow = Leg { s: 360.0 / SLOW_ROUND_DEG_S, per_s: SLOW_ROUND_DEG_S };
            let rest = |s| Leg { s, per_s: 0.0 };
            let ends = vec![("flick, slow round", slow.s + PAUSE_S), ("flick", f64::INFINITY)];
            (vec![slow, rest(PAUSE_S), Leg { s: FLICK_S, per_s: FLICK_DEG_S }, rest(REST_S)], ends)
        }
        Motion::Walk => {
            let (s, per_s) = place.walk();
            (vec![Leg { s, per_s }, Leg { s, per_s: -per_s }], vec![("walk", f64::INFINITY)])
        }
        Motion::Turn => (vec![Leg { s: 360.0 / TURN_DEG_S, per_s: TURN_DEG_S }], vec![("turn", f64::INFINITY)]),
        Motion::Rest => {
            let stopped_s = SLOW_ORBIT_S + EASE_S;
            let [soon_s, later_s] = RESTS_AFTER_S.map(|after_s| stopped_s + after_s);
            let ends = vec![
                ("rest, moving", stopped_s),
                ("", soon_s),
                ("rest, after 0.5 s", soon_s + LOOK_S),
                ("", later_s),
                ("rest, after 1 s", later_s + LOOK_S),
                ("", stopped_s + REST_S - LOOK_S),
                ("rest, at the end", f64::INFINITY),
            ];
            (vec![Leg { s: SLOW_ORBIT_S, per_s: SLOW_ORBIT_DEG_S }, Leg { s: REST_S, per_s: 0.0 }], ends)
        }
    };
    let pose = |t_s: f64| place.eye(motion, gone(&legs, t_s), t_s);
    let count = (seconds(&legs) * hz + 0.01).floor() as usize + 1;
    let times = (0..count).map(|index| index as f64 / hz);
    let poses = times.map(|t_s| TracePose { t_s, world_from_eye: pose(t_s) }).collect();
    let mut begin_s = 0.0;
    let parts = ends.into_iter().map(|(name, end_s)| {
        let part = Part { name: name.to_owned(), time_s: begin_s..end_s };
        begin_s = end_s;
        part
    });
    Way { trace: Trace { poses }, parts: parts.filter(|part| !part.name.is_empty()).collect() }
}

/// For how long one looks at a picture at rest: two frames of 60 a second, with room for their rounding.
pub const LOOK_S: f64 = 2.0 / 60.0;

/// What a scene says about how one moves in it.
struct Place {
    start: Rigid,
    /// What an orbit goes round.
    pivot_world: DVec3,
    /// Along the ground, where one walks; how far that way is free.
    walks: Option<(DVec3, f64)>,
}

impl Place {
    fn of(scene: &Scene) -> Place {
        let start = start_pose(scene);
        if !scene.walk {
            return Place { start, pivot_world: scene.bounds.centre(), walks: None };
        }
        let snapshot = scene.at(0.0);
        let rays = RayTruth::new(scene, &snapshot, &SceneLook::new(scene, Look::Plain).lighting(&snapshot));
        let forward = start.transform_vector(DVec3::Z);
        let ahead = DVec3::new(forward.x, 0.0, forward.z).normalize_or(DVec3::NEG_Z);
        let free_m = rays.free_m(start.translation, ahead, f64::MAX);
        let pivot_world = start.translation + ahead * ring_m(&rays, start.translation, ahead, free_m);
        Place { start, pivot_world, walks: Some((ahead, free_m)) }
    }

    /// Seconds and speed of the way out: in metres where one walks, else in distances to the middle.
    fn walk(&self) -> (f64, f64) {
        match self.walks {
            Some((_, free_m)) => (WALK_S, WALK_M_S.min((free_m - ARM_M).max(0.0) / WALK_S)),
            None => (WALK_S, PAST_PER_S),
        }
    }

    /// The eye that has gone a way: degrees, or the unit of [`Place::walk`].
    fn eye(&self, motion: Motion, gone: f64, t_s: f64) -> Rigid {
        match (motion, self.walks) {
            (Motion::Turn, _) | (Motion::Flick, Some(_)) => self.turned_about(self.start.translation, gone),
            (Motion::Orbit | Motion::Rest | Motion::Flick, _) => self.turned_about(self.pivot_world, gone),
            (Motion::Walk, Some((ahead, _))) => {
                let head_rad = -(HEAD_DEG.to_radians()) * (TAU / HEAD_SWING_S * t_s).sin();
                let rotation = DQuat::from_rotation_y(head_rad) * self.start.rotation;
                Rigid { translation: self.start.translation + ahead * gone, rotation: rotation.normalize() }
            }
            (Motion::Walk, None) => {
                let distance_m = self.start.translation.distance(self.pivot_world);
                let eye = self.start.transform_point(DVec3::X * (gone * distance_m));
                Rigid::look_at(eye, self.pivot_world)
            }
        }
    }

    fn turned_about(&self, pivot_world: DVec3, turn_deg: f64) -> Rigid {
        let turn = DQuat::from_rotation_y(turn_deg.to_radians());
        Rigid {
            translation: pivot_world + turn * (self.start.translation - pivot_world),
            rotation: (turn * self.start.rotation).normalize(),
        }
    }
}

/// The largest radius of a free way round a point ahead, 0 where there is none.
fn ring_m(rays: &RayTruth, eye_world: DVec3, ahead: DVec3, free_m: f64) -> f64 {
    let is_free = |radius_m: f64| {
        let pivot_world = eye_world + ahead * radius_m;
        let corner = |side: u32| {
            pivot_world - DQuat::from_rotation_y(TAU * f64::from(side) / f64::from(RING_SIDES)) * ahead * radius_m
        };
        (0..RING_SIDES).all(|side| {
            let way = corner(side + 1) - corner(side);
            rays.free_m(corner(side), way.normalize_or(ahead), way.length()) >= way.length()
        })
    };
    let radii = (0..=RING_HALVINGS).map(|halvings| free_m.min(RING_M) / 2_f64.powi(halvings));
    radii.into_iter().find(|&radius_m| is_free(radius_m)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: f64 = 60.0;

    fn moved(scene: &str, motion: Motion) -> (Scene, Way) {
        let scene = scene::builtin::load(scene).expect("built in");
        let way = way(motion, &scene, ORBIT_S, HZ);
        (scene, way)
    }

    /// Degrees a second between two neighbouring poses.
    fn turns_deg_s(way: &Way) -> Vec<f64> {
        let turn = |pair: &[TracePose]| {
            let [a, b] = [pair[0], pair[1]].map(|pose| pose.world_from_eye.rotation);
            a.angle_between(b).to_degrees() * HZ
        };
        way.trace.poses.windows(2).map(turn).collect()
    }

    fn eye_m(way: &Way, t_s: f64) -> DVec3 {
        way.trace.at(t_s).translation
    }

    #[test]
    fn an_orbit_goes_round_once_in_its_time_and_begins_gently() {
        let (scene, way) = moved("tree", Motion::Orbit);
        let centre = scene.bounds.centre();
        let distance = |t_s| (eye_m(&way, t_s) - centre).length();
        assert!((0..50).all(|step| (distance(f64::from(step) * 0.1) / distance(0.0) - 1.0).abs() < 1e-9));
        let turns = turns_deg_s(&way);
        assert!(turns[1] < 60.0 && turns[2] < 90.0, "{:?}", &turns[..4]);
        // The look is tilted, and turns with the eye about the vertical: by less than the eye goes round.
        let end_s = way.parts[0].time_s.end;
        assert!((end_s - 2.55).abs() < 1e-9);
        assert!((eye_m(&way, end_s) - eye_m(&way, 0.0)).length() < 1e-3 * distance(0.0), "a whole round");
        let step = (eye_m(&way, 1.01) - centre).angle_between(eye_m(&way, 1.0) - centre);
        let flat = |t_s| DVec3::new(1.0, 0.0, 1.0) * (eye_m(&way, t_s) - centre);
        assert!(step > 0.0);
        assert!((flat(1.0 + 2.0 / HZ).angle_between(flat(1.0)).to_degrees() * HZ / 2.0 - 144.0).abs() < 0.01);
    }

    #[test]
    fn a_flick_is_half_a_turn_at_once_and_then_rest() {
        for scene in ["tree", "pillars"] {
            let (_, way) = moved(scene, Motion::Flick);
            let flick_s = way.parts[1].time_s.start;
            assert!((flick_s - 6.5).abs() < 1e-9);
            let flat = |t_s: f64| {
                let forward = way.trace.at(t_s).transform_vector(DVec3::Z);
                DVec3::new(forward.x, 0.0, forward.z)
            };
            let deg_s = |t_s: f64| flat(t_s).angle_between(flat(t_s + 1.0 / HZ)).to_degrees() * HZ;
            assert!((deg_s(3.0) - SLOW_ROUND_DEG_S).abs() < 0.01, "{scene}: {}", deg_s(3.0));
            assert!((deg_s(6.8) - FLICK_DEG_S).abs() < 0.01, "{scene}: {}", deg_s(6.8));
            assert!(deg_s(6.3) < 1e-5 && deg_s(7.2) < 1e-5, "{scene}");
            assert!((flat(7.2).angle_between(flat(0.0)).to_degrees() - 180.0).abs() < 0.01, "{scene}");
            assert!((way.trace.duration_s() - 8.6).abs() < 1.0 / HZ, "{scene}");
            let stands = eye_m(&way, 6.8) == eye_m(&way, 0.0);
            assert_eq!(stands, scene == "pillars", "who walks turns on the spot");
        }
    }

    #[test]
    fn a_walker_goes_ahead_and_back_and_does_not_pass_through_walls() {
        let (_, way) = moved("pillars", Motion::Walk);
        let pace = (eye_m(&way, 1.1) - eye_m(&way, 1.0)).length() / 0.1;
        assert!((pace - WALK_M_S).abs() < 1e-6, "{pace}");
        let end_s = way.trace.duration_s();
        assert!((eye_m(&way, end_s) - eye_m(&way, 0.0)).length() < 0.03);
        assert!(turns_deg_s(&way).iter().all(|&deg_s| deg_s < 60.01));
        assert!(turns_deg_s(&way).iter().any(|&deg_s| deg_s > 59.0));
        let (scene, way) = moved("tree", Motion::Walk);
        let centre = scene.bounds.centre();
        let distance_m = (eye_m(&way, 0.0) - centre).length();
        let pace = (eye_m(&way, 1.1) - eye_m(&way, 1.0)).length() / 0.1 / distance_m;
        assert!((pace - PAST_PER_S).abs() < 1e-6, "{pace}");
        let looks_at_it = way.trace.poses.iter().all(|pose| {
            let to_middle = pose.world_from_eye.inverse().transform_point(centre).normalize();
            to_middle.z > 1.0 - 1e-9
        });
        assert!(looks_at_it);
    }

    #[test]
    fn who_turns_comes_round_at_the_stated_speed() {
        let (_, way) = moved("pillars", Motion::Turn);
        assert!((turns_deg_s(&way)[180] - TURN_DEG_S).abs() < 0.01, "{}", turns_deg_s(&way)[180]);
        let end = way.trace.poses.last().expect("poses").world_from_eye;
        assert!(end.rotation.angle_between(way.trace.at(0.0).rotation) < 1e-6);
    }

    #[test]
    fn who_rests_has_stopped() {
        for scene in ["tree", "urban"] {
            let (_, way) = moved(scene, Motion::Rest);
            let stop_s = way.parts[0].time_s.end;
            assert!((stop_s - 1.6).abs() < 1e-9);
            let stopped = way.trace.at(stop_s);
            let poses = way.trace.poses.iter().filter(|pose| pose.t_s > stop_s);
            assert!(poses.clone().count() > 80);
            for pose in poses {
                assert_eq!(pose.world_from_eye, way.trace.poses.last().expect("poses").world_from_eye, "{scene}");
            }
            let forward = |eye: Rigid| eye.transform_vector(DVec3::Z) * DVec3::new(1.0, 0.0, 1.0);
            let turned = forward(stopped).angle_between(forward(way.trace.at(0.0))).to_degrees();
            assert!((turned - SLOW_ORBIT_DEG_S * SLOW_ORBIT_S).abs() < 0.01, "{scene}: {turned}");
            let names: Vec<_> = way.parts.iter().map(|part| part.name.as_str()).collect();
            assert_eq!(names, ["rest, moving", "rest, after 0.5 s", "rest, after 1 s", "rest, at the end"]);
        }
    }

    #[test]
    fn an_orbit_where_one_walks_stays_clear_of_what_stands_there() {
        let (scene, way) = moved("pillars", Motion::Orbit);
        let snapshot = scene.at(0.0);
        let lighting = SceneLook::new(&scene, Look::Plain).lighting(&snapshot);
        let rays = RayTruth::new(&scene, &snapshot, &lighting);
        for pair in way.trace.poses.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|pose| pose.world_from_eye.translation);
            if let Some(along) = (b - a).try_normalize() {
                assert!(rays.free_m(a, along, (b - a).length()) >= (b - a).length(), "at {} s", pair[0].t_s);
            }
        }
        assert!((eye_m(&way, 1.2) - eye_m(&way, 0.0)).length() > 0.5, "it goes round something");
    }
}
