//! A scene ready to be measured: loaded, on the GPU, with its truth.

use std::sync::Arc;

use camera::Pinhole;
use glam::DVec3;
use gpu::Gpu;
use protocol::{Lighting, Look, Sky};
use scene::{Scene, Snapshot};
use server::look::SceneLook;
use server::render::SceneRenderer;
use server::truth::{Truth, TruthRenderer};

use crate::compare::Picture;

/// How far an eye may be from the anchor of the coordinates on the GPU before they are laid anew: f32 keeps a tenth of a
/// millimetre there.
const ANCHOR_REACH_M: f64 = 100.0;

/// Loads the scene that `name` names: a file, or a built-in scene where there is no such file, `scale` times as large.
pub fn load_scene(name: &str, scale: f64) -> anyhow::Result<Scene> {
    let scene = server::source::load(name, scale, &|_| {})?;
    for warning in &scene.warnings {
        tracing::warn!("{}: {warning}", scene.name);
    }
    Ok(scene)
}

/// A scene on the GPU at a time, and the plain renderer of its truth.
pub struct Stage {
    /// The scene.
    pub scene: Scene,
    /// The scene on the GPU.
    pub renderer: SceneRenderer,
    /// Lights at the time of the last [`Stage::show`].
    pub lighting: Lighting,
    truth: TruthRenderer,
    look: SceneLook,
    /// What is on the GPU: snapshot, and whether the scene can change at all.
    shown: Snapshot,
}

impl Stage {
    /// Uploads a scene and shows it at time 0.
    pub fn new(gpu: &Gpu, scene: Scene, look: Look) -> anyhow::Result<Stage> {
        let mut renderer = SceneRenderer::for_look(gpu, &scene, look)?;
        let truth = TruthRenderer::new(&renderer)?;
        let look = SceneLook::new(&scene, look);
        let truth = truth.with_sky(look.sky().cloned());
        let shown = scene.at(0.0);
        renderer.update(&shown, scene.bounds.centre())?;
        let lighting = look.lighting(&shown);
        Ok(Stage { scene, renderer, lighting, truth, look, shown })
    }

    /// The same, ready for methods that follow rays.
    pub fn with_rays(self) -> Stage {
        let renderer = self.renderer.with_rays(&self.scene);
        Stage { renderer, ..self }
    }

    /// Shows the scene at `time_s` to eyes around `eye_world`.
    pub fn show(&mut self, time_s: f64, eye_world: DVec3) -> anyhow::Result<()> {
        let moved = self.scene.is_animated() && time_s != self.shown.time_s;
        if moved {
            self.shown = self.scene.at(time_s);
            self.lighting = self.look.lighting(&self.shown);
        }
        if moved || self.renderer.anchor_world().distance(eye_world) > ANCHOR_REACH_M {
            self.renderer.update(&self.shown, eye_world)?;
        }
        Ok(())
    }

    /// The scene as shown.
    pub fn snapshot(&self) -> &Snapshot {
        &self.shown
    }

    /// Light from all around, of a full look.
    pub fn sky(&self) -> Option<&Arc<Sky>> {
        self.look.sky()
    }

    /// The full scene from a camera, one sample at each pixel's centre.
    pub fn truth(&self, camera: &Pinhole) -> anyhow::Result<Truth> {
        Ok(self.truth.render(&self.renderer, camera, &self.lighting)?)
    }

    /// The same with 16 samples a pixel, averaged in linear light.
    pub fn smooth_truth(&self, camera: &Pinhole) -> anyhow::Result<Truth> {
        Ok(self.truth.render_smooth(&self.renderer, camera, &self.lighting)?)
    }
}

/// The truth as a picture with its mask.
pub fn picture(truth: &Truth) -> Picture {
    Picture::from_rgba(truth.size_px.0, truth.size_px.1, truth.colour.as_flattened())
}
