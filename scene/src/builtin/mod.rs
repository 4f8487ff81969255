//! Built-in scenes, made by code: the same on every machine, no files needed.
//!
//! Every scene has a moving variant, `NAME-moving`, of the same geometry. Triangle counts are near those of the scenes of
//! the same kind in Xie, Wang, Popescu 2016 and in the non-pinhole papers. [`stiff`] lists scenes that strain the
//! numbers, [`simple`] those of which much can be left out: for tests and reports, not for the eye.

mod barrels;
mod birdnest;
mod car;
mod figure;
mod grass;
mod kit;
mod maze;
mod mesher;
mod mural;
mod newell;
mod parking;
mod pillars;
mod rng;
mod stiff;
mod teapots;
mod texture;
mod track;
mod tree;
mod urban;

use crate::model::{Scene, SceneCamera};
use kit::Kit;

/// What is shown when nobody asks for a scene.
pub const DEFAULT: &str = "urban-moving";

/// Height of a walker's eyes above the ground.
pub const EYE_HEIGHT_M: f64 = 1.7;

/// The still and the moving name of a scene, and what builds both.
type Entry = (&'static str, &'static str, fn() -> Kit);

const SCENES: &[Entry] = &[
    ("teapots", "teapots-moving", teapots::build),
    ("birdnest", "birdnest-moving", birdnest::build),
    ("grass", "grass-moving", grass::build),
    ("urban", "urban-moving", urban::build),
    ("tree", "tree-moving", tree::build),
    ("maze", "maze-moving", maze::build),
    ("pillars", "pillars-moving", pillars::build),
    ("barrels", "barrels-moving", barrels::build),
    ("cars", "cars-moving", parking::build),
];

const STIFF: &[Entry] = &[
    ("far", "far-moving", stiff::far),
    ("near-far", "near-far-moving", stiff::near_far),
    ("degenerate", "degenerate-moving", stiff::degenerate),
    ("tiny", "tiny-moving", stiff::tiny),
    ("huge", "huge-moving", stiff::huge),
];

/// Scenes that need little: for what is left out.
const SIMPLE: &[Entry] = &[("mural", "mural-moving", mural::build)];

fn all() -> impl Iterator<Item = &'static Entry> {
    SCENES.iter().chain(STIFF).chain(SIMPLE)
}

/// Names of the scenes, still ones and their moving variants.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of the scenes that strain the numbers, each still and moving: something 1e7 m from the origin, depths from 0.1 m
/// to 1e5 m, broken triangles (with a warning), 1e-4 m and 1e6 m across.
pub fn stiff() -> impl Iterator<Item = &'static str> {
    STIFF.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of scenes that need little, each still and moving: a wall that one image covers.
pub fn simple() -> impl Iterator<Item = &'static str> {
    SIMPLE.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// The built-in scene of that name, stiff and simple ones included; `None` where there is none.
pub fn load(name: &str) -> Option<Scene> {
    all().find_map(|&(still, moving, build)| match name {
        _ if name == still => Some(build().finish(name, false)),
        _ if name == moving => Some(build().finish(name, true)),
        _ => None,
    })
}

/// Free places at eye height in a scene that is walked in, each with a direction worth looking along: nothing of the
/// still scene is within half a metre of the eye. Empty for scenes that are turned, and for unknown names.
pub fn walk_eyes(name: &str) -> Vec<SceneCamera> {
    match name.strip_suffix("-moving").unwrap_or(name) {
        "grass" => grass::eyes(),
        "maze" => maze::eyes(),
        "pillars" => pillars::eyes(),
        "urban" => urban::eyes(),
        _ => Vec::new(),
    }
}

/// After how many seconds a scene's motion repeats.
#[cfg(test)]
fn scene_period_s(name: &str) -> f64 {
    let found = all().find(|(still, moving, _)| [*still, *moving].contains(&name));
    found.map_or(f64::NAN, |(_, _, build)| build().period_s())
}

#[cfg(test)]
mod tests;
