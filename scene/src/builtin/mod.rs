//! Built-in scenes, made by code: the same on every machine, no files needed.
//!
//! Every scene has a moving variant, `NAME-moving`, of the same geometry. Triangle counts are near those of the scenes of
//! the same kind in Xie, Wang, Popescu 2016 and in the non-pinhole papers. [`stiff`] lists scenes that strain the
//! numbers: for tests, not for the eye.

mod birdnest;
mod car;
mod figure;
mod kit;
mod mesher;
mod pillars;
mod rng;
mod texture;
mod track;
mod urban;

use crate::model::{Scene, SceneCamera};
use kit::Kit;

/// What is shown when nobody asks for a scene.
pub const DEFAULT: &str = "urban-moving";

/// Height of a walker's eyes above the ground.
pub const EYE_HEIGHT_M: f64 = 1.7;

/// The still and the moving name of each scene, and what builds both.
const SCENES: &[(&str, &str, fn() -> Kit)] = &[
    ("birdnest", "birdnest-moving", birdnest::build),
    ("pillars", "pillars-moving", pillars::build),
    ("urban", "urban-moving", urban::build),
];

/// Names of the scenes, still ones and their moving variants.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// The built-in scene of that name; `None` where there is none.
pub fn load(name: &str) -> Option<Scene> {
    SCENES.iter().find_map(|&(still, moving, build)| match name {
        _ if name == still => Some(build().finish(name, false)),
        _ if name == moving => Some(build().finish(name, true)),
        _ => None,
    })
}

/// Free places at eye height in a scene that is walked in, each with a direction worth looking along: nothing of the
/// still scene is within half a metre of the eye. Empty for scenes that are turned, and for unknown names.
pub fn walk_eyes(name: &str) -> Vec<SceneCamera> {
    match name.strip_suffix("-moving").unwrap_or(name) {
        "pillars" => pillars::eyes(),
        "urban" => urban::eyes(),
        _ => Vec::new(),
    }
}

/// After how many seconds a scene's motion repeats.
#[cfg(test)]
fn scene_period_s(name: &str) -> f64 {
    let found = SCENES.iter().find(|(still, moving, _)| [*still, *moving].contains(&name));
    found.map_or(f64::NAN, |(_, _, build)| build().period_s())
}

#[cfg(test)]
mod tests;
