//! Built-in scenes, made by code: the same on every machine, no files needed.
//!
//! Every scene has a moving variant, `NAME-moving`, of the same geometry. Triangle counts are near those of the scenes
//! of the same kind in Xie, Wang, Popescu 2016 and in the non-pinhole papers. [`stiff`] lists scenes that strain the
//! numbers, [`simple`] those of which much can be left out: for tests and reports, not for the eye. [`reflecting()`]
//! lists those with a mirror or a body of glass, with a way of the camera that shows it ([`reflection_path`]).

mod barrels;
mod birdnest;
mod car;
mod chrome_car;
mod figure;
mod grass;
mod kit;
mod lake;
mod lamplit;
mod maze;
mod mesher;
mod mirror_maze;
mod model;
mod mural;
mod newell;
mod parking;
mod pillars;
mod reflecting;
mod rng;
mod stiff;
mod teapots;
mod texture;
mod track;
mod tree;
mod urban;
mod window;

use crate::model::{Scene, SceneCamera};
use camera::Trace;
pub use kit::EYE_HEIGHT_M;
use kit::Kit;
pub use model::load_with;

/// What is shown when nobody asks for a scene.
pub const DEFAULT: &str = "urban-moving";

/// The still and the moving name of a scene, and what builds both.
type Entry = (&'static str, &'static str, fn() -> Kit);

const SCENES: &[Entry] = &[
    ("teapots", "teapots-moving", teapots::build),
    ("lamp-teapots", "lamp-teapots-moving", lamplit::build),
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

/// Scenes in which something is seen through.
const BLENDED: &[Entry] =
    &[("window", "window-moving", window::build), ("alpha-boards", "alpha-boards-moving", window::boards)];

const REFLECTING: &[Entry] = &[
    ("mirror-teapots", "mirror-teapots-moving", reflecting::mirror),
    ("glass-teapots", "glass-teapots-moving", reflecting::glass),
    ("mirror-maze", "mirror-maze-moving", mirror_maze::build),
    ("mirror-pair", "mirror-pair-moving", reflecting::pair),
    ("chrome-car", "chrome-car-moving", chrome_car::build),
    ("lake", "lake-moving", lake::build),
];

const ROUGH: &[Entry] = &[("rough-teapots", "rough-teapots-moving", reflecting::rough)];

fn all() -> impl Iterator<Item = &'static Entry> {
    SCENES.iter().chain(STIFF).chain(SIMPLE).chain(BLENDED).chain(REFLECTING).chain(ROUGH)
}

/// Names of the scenes, still ones and their moving variants.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of the scenes that strain the numbers, each still and moving: something 1e7 m from the origin, depths from 0.1
/// m to 1e5 m, broken triangles (with a warning), 1e-4 m and 1e6 m across.
pub fn stiff() -> impl Iterator<Item = &'static str> {
    STIFF.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of scenes that need little, each still and moving: a wall that one image covers.
pub fn simple() -> impl Iterator<Item = &'static str> {
    SIMPLE.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of scenes in which something is seen through, each still and moving: a window with moving things behind it, and a board for each way
/// in which alpha may count.
pub fn blended() -> impl Iterator<Item = &'static str> {
    BLENDED.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of the scenes in which objects, whose names hold "mirror" or "glass", reflect or refract the others, each
/// still and moving: a teapot as a mirror, a body of glass, a mirror that is rolled through a maze, two mirrors that see each
/// other, a car of many chrome parts, and a lake. In the last three, reflectors fill at least 15 % of the picture. Materials say
/// so by `metallic` 1 with `roughness` 0, and by `transmission` 1 with `ior` 1.3; without reflections they are scenes
/// like any others.
pub fn reflecting() -> impl Iterator<Item = &'static str> {
    REFLECTING.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// Names of scenes of rough metals, each still and moving, in which the full look shows what is near as a blur: a pot and a tray.
pub fn rough() -> impl Iterator<Item = &'static str> {
    ROUGH.iter().flat_map(|&(still, moving, _)| [still, moving])
}

/// The names that a person is offered: all but those of [`stiff`].
pub fn offered() -> impl Iterator<Item = &'static str> {
    names().chain(blended()).chain(reflecting()).chain(rough())
}

/// Whether [`load`] has a scene of that name.
pub fn has(name: &str) -> bool {
    all().any(|&(still, moving, _)| name == still || name == moving) || meadow_blades(name).is_some()
}

/// 60 poses, ten a second, that see the reflector of a scene of [`reflecting()`] or [`rough()`]; `None` for other names. Pose
/// `k` belongs to the scene at `k / 10` seconds. Eyes go 60 degrees around a pot on a table; in the maze they follow
/// the mirror as it rolls, or come nearer where it stands. What [`load_with`] names has the path of the scene that it is made from.
pub fn reflection_path(name: &str) -> Option<Trace> {
    match name.split_once('+').map_or(name, |(scene, _)| scene) {
        "mirror-teapots" | "mirror-teapots-moving" => Some(reflecting::path(reflecting::MIRROR_WORLD, 0.25)),
        "rough-teapots" | "rough-teapots-moving" => Some(reflecting::path(reflecting::MIRROR_WORLD, 0.25)),
        "glass-teapots" | "glass-teapots-moving" => Some(reflecting::path(reflecting::GLASS_WORLD, 0.1)),
        "mirror-maze" => Some(mirror_maze::path(false)),
        "mirror-maze-moving" => Some(mirror_maze::path(true)),
        "mirror-pair" | "mirror-pair-moving" => Some(reflecting::pair_path()),
        "chrome-car" | "chrome-car-moving" => Some(chrome_car::path()),
        "lake" | "lake-moving" => Some(lake::path()),
        _ => None,
    }
}

/// Blades a tuft of a meadow at most: 3.0 million triangles.
const MAX_BLADES: usize = 2304;

/// `grass-N-blades`: the meadow with N blades a tuft, 1 to 2,304, where `grass` has 36. What grows with the number of triangles alone is
/// measured by it; the meadow's size stays.
fn meadow(name: &str) -> Option<Scene> {
    meadow_blades(name).map(|blades| grass::with_blades(blades).finish(name, false))
}

fn meadow_blades(name: &str) -> Option<usize> {
    let blades = name.strip_prefix("grass-")?.strip_suffix("-blades")?.parse().ok()?;
    (1..=MAX_BLADES).contains(&blades).then_some(blades)
}

/// The built-in scene of that name, those of all lists included, or the meadow `grass-N-blades` with N blades a tuft (1 to 2,304; `grass` has
/// 36); `None` where there is none.
pub fn load(name: &str) -> Option<Scene> {
    let listed = all().find_map(|&(still, moving, build)| match name {
        _ if name == still => Some(build().finish(name, false)),
        _ if name == moving => Some(build().finish(name, true)),
        _ => None,
    });
    listed.or_else(|| meadow(name))
}

/// Free places at eye height in a scene that is walked in, each with a direction worth looking along: nothing of the
/// still scene is within half a metre of the eye. Empty for scenes that are turned, and for unknown names.
pub fn walk_eyes(name: &str) -> Vec<SceneCamera> {
    match name.strip_suffix("-moving").unwrap_or(name) {
        "grass" => grass::eyes(),
        "maze" => maze::eyes(),
        "mirror-maze" => mirror_maze::eyes(),
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
