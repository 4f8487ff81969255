//! What walkers saw: pictures of what some of them held at moments of a run, beside the truth there. All are drawn after the run, so that they cost it
//! nothing.

use anyhow::Context;
use camera::{Pinhole, Rigid};
use gpu::Gpu;
use protocol::message::Clock;
use protocol::{Held, Look};
use scene::Scene;
use surface::HeldSurfaces;

use crate::client_view::{ClientView, HeldSet};
use crate::compare::score;
use crate::stage::{Stage, load_scene, picture};

/// Clients that are looked at: the first ones.
pub const CLIENTS: usize = 5;
/// At these shares of the time, when first sets have long been there.
pub(super) const AT: [f64; 3] = [0.5, 0.7, 0.9];

const SIZE_PX: (u32, u32) = (320, 180);

/// What a client held while it looked from somewhere.
#[derive(Debug, Clone)]
pub struct Moment {
    pub(super) held: Held,
    pub(super) world_from_eye: Rigid,
}

/// A scene that pictures can be compared with; what cannot is said before a run, not after it.
pub(super) fn still_scene(name: &str, clock: Clock) -> anyhow::Result<Scene> {
    anyhow::ensure!(clock == Clock::Wall, "pictures are kept in real time only");
    let scene = load_scene(name, 1.0)?;
    anyhow::ensure!(!scene.is_animated(), "{name} moves: what it was at a moment, only the server knows");
    Ok(scene)
}

/// FLIP over covered pixels at each moment, of a still scene in the plain look.
pub(super) fn flip_covered(scene: Scene, fov_y_rad: f64, moments: Vec<Moment>) -> anyhow::Result<Vec<f64>> {
    let gpu = pollster::block_on(Gpu::new_headless())?;
    let near_m = server::start::near_m(&scene);
    let mut stage = Stage::new(&gpu, scene, Look::Plain)?;
    let mut view = ClientView::new(&gpu, SIZE_PX)?;
    let at = |Moment { held, world_from_eye }| -> anyhow::Result<f64> {
        let camera = Pinhole::symmetric(world_from_eye, SIZE_PX, fov_y_rad, near_m);
        stage.show(0.0, world_from_eye.translation)?;
        let truth = picture(&stage.smooth_truth(&camera)?);
        let mut surfaces = HeldSurfaces::new(&gpu);
        surfaces.rebuild(&held);
        let set = HeldSet::of(&gpu, held, surfaces);
        let drawn = view.frame(&set, &camera, Default::default())?;
        score(&drawn.picture, &truth, None)?.flip_covered.context("nothing is covered")
    };
    moments.into_iter().map(at).collect()
}
