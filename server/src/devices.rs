//! The GPU's device that a scene lies on, and how both are made anew where the device is lost: a driver was reset, or an adapter taken away.

use std::sync::{Arc, Mutex, PoisonError};

use gpu::Gpu;
use scene::Scene;

use crate::config::Config;
use crate::render::{RenderError, SceneRenderer};

/// What is needed to make them anew.
pub struct Devices {
    /// Which adapter, by its number or a part of its name.
    wanted: Option<String>,
    /// What lies on it.
    pub scene: Arc<Scene>,
    /// How it is drawn.
    pub config: Config,
    now: Mutex<Option<Placed>>,
}

/// A scene on the newest device.
struct Placed {
    /// Devices before it.
    number: u32,
    gpu: Gpu,
    /// What others' are twins of; `None` where each needs its own.
    renderer: Option<SceneRenderer>,
}

impl Devices {
    /// None is lost yet.
    pub fn new(wanted: Option<String>, scene: Arc<Scene>, config: Config) -> Devices {
        Devices { wanted, scene, config, now: Mutex::default() }
    }

    /// The scene on the device that follows a lost one, and how many were lost before it. All who lost the same get the same.
    pub fn after(&self, lost: u32) -> Result<(u32, SceneRenderer), RenderError> {
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(placed) = now.as_ref().filter(|placed| placed.number > lost && placed.gpu.check().is_ok()) {
            let twin = placed.renderer.as_ref().and_then(SceneRenderer::twin);
            let renderer = twin.map_or_else(|| prepared(&placed.gpu, &self.scene, &self.config), Ok)?;
            return Ok((placed.number, renderer));
        }
        let gpu = pollster::block_on(Gpu::new_headless_on(self.wanted.as_deref()))?;
        tracing::info!("draws on {} from now on", gpu.caps.name);
        let renderer = prepared(&gpu, &self.scene, &self.config)?;
        let number = now.as_ref().map_or(lost, |placed| placed.number.max(lost)) + 1;
        *now = Some(Placed { number, gpu, renderer: renderer.twin() });
        Ok((number, renderer))
    }
}

/// A scene as a server draws it.
pub fn prepared(gpu: &Gpu, scene: &Scene, config: &Config) -> Result<SceneRenderer, RenderError> {
    let renderer = SceneRenderer::for_look(gpu, scene, config.look)?;
    Ok(if config.discretization.needs_rays() { renderer.with_rays(scene) } else { renderer })
}
