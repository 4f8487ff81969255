//! What a server needs from whatever makes depth images: the seam between sessions and the GPU.

use camera::Pinhole;
use glam::DVec3;
use gpu::Gpu;
use protocol::{DepthImage, Lighting, Material};
use rayon::prelude::*;
use scene::{Scene, Snapshot};
use thiserror::Error;

use crate::config::Config;
use crate::discretize::{DepthPrecision, Discretization, Discretizer, TexelTest};
use crate::look::SceneLook;
use crate::render::{RenderError, SceneRenderer};

/// Why no images could be made.
#[derive(Debug, Error)]
pub enum ImagerError {
    /// The scene does not fit, or the GPU or its driver gave up; the server cannot go on.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// Makes depth images of one scene. One thread owns it.
pub trait Imager: Send {
    /// What draws, for people: the adapter's name and kind.
    fn adapter(&self) -> String;

    /// The table that the samples' material codes index.
    fn materials(&self) -> Vec<Material>;

    /// The lights of a snapshot, as clients shade with them.
    fn lighting(&self, snapshot: &Snapshot) -> Lighting;

    /// One image a view, in order; image `i` leaves out what an earlier one holds where the imager is set to.
    fn images(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        precision: DepthPrecision,
    ) -> Result<Vec<DepthImage>, ImagerError>;
}

/// The imager of a real server.
pub struct GpuImager {
    renderer: SceneRenderer,
    discretizer: Discretizer,
    method: Discretization,
    look: SceneLook,
    adapter: String,
    /// Scene time and anchor of what is on the GPU now.
    placed: Option<(f64, DVec3)>,
}

/// The GPU works in f32 relative to an anchor; closer than this, positions near the eye keep 10 micrometres.
const MAX_ANCHOR_DISTANCE_M: f64 = 64.0;

impl GpuImager {
    /// Uploads a scene.
    pub fn new(gpu: &Gpu, scene: &Scene, config: &Config) -> Result<GpuImager, ImagerError> {
        let renderer = SceneRenderer::new(gpu, scene)?;
        let discretizer = Discretizer::new(&renderer, TexelTest::default())?;
        let look = SceneLook::new(scene, config.look);
        let kind = if gpu.caps.software { "software" } else { "hardware" };
        let adapter = format!("{} ({kind})", gpu.caps.name);
        Ok(GpuImager { renderer, discretizer, method: config.discretization, look, adapter, placed: None })
    }

    fn place(&mut self, snapshot: &Snapshot, eye_world: DVec3) -> Result<(), ImagerError> {
        let near = |&(time_s, anchor): &(f64, DVec3)| {
            time_s == snapshot.time_s && anchor.distance(eye_world) < MAX_ANCHOR_DISTANCE_M
        };
        if !self.placed.as_ref().is_some_and(near) {
            self.renderer.update(snapshot, eye_world)?;
            self.placed = Some((snapshot.time_s, eye_world));
        }
        Ok(())
    }
}

impl Imager for GpuImager {
    fn adapter(&self) -> String {
        self.adapter.clone()
    }

    fn materials(&self) -> Vec<Material> {
        self.renderer.materials().to_vec()
    }

    fn lighting(&self, snapshot: &Snapshot) -> Lighting {
        self.look.lighting(snapshot)
    }

    fn images(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        precision: DepthPrecision,
    ) -> Result<Vec<DepthImage>, ImagerError> {
        let Some(first) = views.first() else { return Ok(Vec::new()) };
        self.place(snapshot, first.world_from_eye.translation)?;
        let captures = self.discretizer.run(&self.renderer, views, self.method)?.wait()?;
        Ok(captures.par_iter().map(|capture| capture.depth_image(precision)).collect())
    }
}
