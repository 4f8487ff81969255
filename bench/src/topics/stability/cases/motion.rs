//! Objects that move as no thing does, and clocks that do not run evenly.
//!
//! A server's own stage looks at each of the times, and sends poses, samples, or both. After each look the client's picture is laid beside rays through the scene
//! at the time that it then shows: at once for holes and numbers, and for depths and colours after as many more looks as the server takes to trim what stands over, as where a side
//! that was seen edge-on turns to the eye.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3};
use scene::Scene;

use super::stiff::Stiff;
use crate::raytrace::Effects;
use crate::topics::stability::build::{Placed, Places, at, cuboid, moving, scene, square};
use crate::topics::stability::case::Case;
use crate::topics::stability::check::Check;
use crate::topics::stability::judge::Errors;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::served::{MARGIN_PX, Served};
use crate::topics::stability::way::Shown;

pub(super) const CASES: &[Stiff] = &[
    Stiff {
        name: "half a turn in one step",
        judge: |lab| judged(lab, |_, time_s, place| place * DAffine3::from_rotation_y(PI * time_s / STEP_S), &EVEN),
    },
    Stiff { name: "a jump of 1e6 m and back", judge: |lab| judged(lab, jump, &EVEN) },
    Stiff { name: "a vibration of 1 kHz, seen ten times a second", judge: |lab| judged(lab, vibration, &EVEN) },
    Stiff {
        name: "a scale through zero to its negative",
        judge: |lab| judged(lab, through_zero, &[0.0, 0.25, 0.5, 0.75, 1.0]),
    },
    Stiff {
        name: "a scale that turns negative between two looks",
        // Samples of the box at half its size are twice as wide at all of it.
        judge: |lab| judged_within(lab, through_zero, &[0.1, 0.35, 0.6, 0.85, 1.1], 2 * MARGIN_PX),
    },
    Stiff { name: "a time of 1e9 s", judge: |lab| judged(lab, turning, &[1e9, 1e9 + STEP_S, 1e9 + 2.0 * STEP_S]) },
    Stiff { name: "a clock that steps back", judge: |lab| judged(lab, turning, &[5.0, 5.1, 2.0, 2.1, -7.0]) },
    Stiff { name: "steps of no time", judge: |lab| judged(lab, turning, &[1.0, 1.0, 1.0]) },
    Stiff { name: "a step of an hour", judge: |lab| judged(lab, turning, &[0.0, 3600.0, 3600.1]) },
];

/// After a look in passing one from the rim finds what is new there, and each look more halves what stands over, four times at most.
const LOOKS_TO_TRIM: usize = 5;
/// Of the server's looks.
const STEP_S: f64 = 0.1;
const EVEN: [f64; 4] = [0.0, STEP_S, 2.0 * STEP_S, 3.0 * STEP_S];

/// A box before a wall; the box is object 1.
fn boxed() -> Scene {
    let parts = vec![
        Placed { mesh: square(), world_from_mesh: at(DVec3::new(0.0, 0.0, -1.0), 1.5), colour: [0.5, 0.4, 0.3] },
        Placed { mesh: cuboid(), world_from_mesh: at(DVec3::ZERO, 0.3), colour: [0.2, 0.4, 0.7] },
    ];
    scene("box", parts)
}

fn turning(_: usize, time_s: f64, place: DAffine3) -> DAffine3 {
    place * DAffine3::from_rotation_y(TAU * (time_s / 7.0).fract())
}

/// Away in every second step.
fn jump(_: usize, time_s: f64, place: DAffine3) -> DAffine3 {
    let is_away = (time_s / STEP_S).round() as i64 % 2 != 0;
    DAffine3::from_translation(if is_away { DVec3::new(1e6, 0.0, 0.0) } else { DVec3::ZERO }) * place
}

/// A little off a whole number of times a step, so that it seems to swing slowly.
fn vibration(_: usize, time_s: f64, place: DAffine3) -> DAffine3 {
    DAffine3::from_translation(DVec3::X * 0.2 * (TAU * 1001.5 * time_s).sin()) * place
}

/// From 1 to -1 within a second, of the looks that show it: a look shows what will be a step later. As of all scenes, its places can be inverted: where the scale vanishes it is a millionth.
fn through_zero(_: usize, time_s: f64, place: DAffine3) -> DAffine3 {
    const LEAST: f64 = 1e-6;
    let scale = 1.0 - 2.0 * (time_s - STEP_S);
    let scale = if scale.abs() < LEAST { LEAST } else { scale };
    DAffine3 { matrix3: place.matrix3 * DMat3::from_diagonal(DVec3::splat(scale)), ..place }
}

/// What is found at each of the times, worst.
fn judged(lab: &mut Lab, places: Places, times_s: &[f64]) -> anyhow::Result<Vec<Check>> {
    judged_within(lab, places, times_s, MARGIN_PX)
}

/// The same, so many pixels from outlines.
fn judged_within(lab: &mut Lab, places: Places, times_s: &[f64], margin_px: usize) -> anyhow::Result<Vec<Check>> {
    let scene = moving(boxed(), &[1], places);
    let case = Case::look(scene, DVec3::new(0.4, 0.5, 2.4), DVec3::ZERO, 0.01);
    let mut served = Served::new(lab, case, &Served::usual())?;
    let (mut at_once, mut trimmed) = (Vec::new(), Vec::new());
    for &time_s in times_s {
        served.tick(time_s)?;
        at_once.push(served.shown(&lab.gpu, &mut lab.view, &Effects::PLAIN)?);
        for _ in 0..LOOKS_TO_TRIM {
            served.tick(time_s)?;
        }
        trimmed.push(Shown { margin_px, ..served.shown(&lab.gpu, &mut lab.view, &Effects::PLAIN)? });
    }
    let [at_once, trimmed] = [at_once, trimmed].map(|shown| Errors::of(&shown));
    let mut checks = Check::of_all(&at_once);
    checks.truncate(2);
    checks.extend(Check::of_flat(&trimmed).split_off(2));
    Ok(checks)
}
