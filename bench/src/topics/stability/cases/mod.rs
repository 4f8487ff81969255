//! Stiff and extreme cases, each a small scene made by code with bounds and where these come from.
//!
//! - [`stiff`]: what a case is.
//! - [`triangles`]: shapes and sizes of triangles. [`eyes`]: where an eye may stand, and along what its rays run.
//! - [`places`]: transforms of what stands still. [`motion`]: of what moves, and odd clocks.
//! - [`samples`]: images of next to nothing, or of one depth.
//! - [`lights`], [`mirrors`], [`cameras`]: effects; those of their parameters that have decades are swept ([`effects`]).

mod cameras;
mod effects;
mod eyes;
mod lights;
mod mirrors;
mod motion;
mod places;
mod samples;
mod stiff;
mod triangles;

pub use effects::Effect;

use stiff::Stiff;

/// Some cases of one kind.
pub struct Group {
    pub name: &'static str,
    pub cases: &'static [Stiff],
}

/// All of them.
pub const GROUPS: &[Group] = &[
    Group { name: "shapes of triangles", cases: triangles::CASES },
    Group { name: "places of eyes", cases: eyes::CASES },
    Group { name: "places of objects", cases: places::CASES },
    Group { name: "motion and clocks", cases: motion::CASES },
    Group { name: "few samples", cases: samples::CASES },
    Group { name: "lights", cases: lights::CASES },
    Group { name: "mirrors, glass, ambient light", cases: mirrors::CASES },
    Group { name: "other cameras", cases: cameras::CASES },
];

/// Sweeps of effects.
pub fn effects() -> impl Iterator<Item = &'static Effect> {
    lights::EFFECTS.iter().chain(cameras::EFFECTS)
}
