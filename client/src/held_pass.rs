//! Everything held, drawn from a camera: what views and shadow maps begin with.

use camera::Pinhole;
use gpu::Gpu;
use surface::{GBuffer, Smoothing, SurfaceError, SurfacePass};

use crate::frame::Shown;
use crate::relief::{ReliefInputs, ReliefPass};

/// Draws surfaces, and objects shown by reliefs, into a [`GBuffer`]; the nearest wins.
#[derive(Debug)]
pub(crate) struct HeldPass {
    gpu: Gpu,
    surface: SurfacePass,
    /// Made when a relief first shows something.
    relief: Option<ReliefPass>,
}

impl HeldPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<HeldPass, SurfaceError> {
        Ok(HeldPass { gpu: gpu.clone(), surface: SurfacePass::new(gpu)?, relief: None })
    }

    /// Clears the targets and draws everything held as seen by `camera`, whose size is the targets'.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: Shown<'_>,
        camera: &Pinhole,
        smoothing: Smoothing,
        target: &GBuffer,
    ) {
        let Shown { surfaces, held, impostors } = shown;
        self.surface.encode(encoder, surfaces, camera, smoothing, target);
        let Some(impostors) = impostors.filter(|_| !held.instances.is_empty()) else { return };
        let embedded = "the shaders are embedded, and tests compose each of them";
        let relief = self.relief.get_or_insert_with(|| ReliefPass::new(&self.gpu).expect(embedded));
        relief.encode(encoder, &ReliefInputs { impostors, held, camera }, target);
    }

    /// Whether a relief ever showed something, and so a pipeline for it exists.
    pub(crate) fn draws_reliefs(&self) -> bool {
        self.relief.is_some()
    }
}
