//! Lights with an area among those that cast: what [`crate::soft`] finds hidden, drawn again only where something changed.

use camera::Pinhole;
use gpu::Gpu;
use surface::{GBuffer, SurfaceError};
use wgpu::BindingResource;

use super::pass::{CHANNELS, SharePass};
use crate::frame::Shown;
use crate::fullscreen::{Binding, FullscreenPass, Onto, Target, uniform};
use crate::held_pass;
use crate::soft::{Count, Lamp, Receivers, Settings, SoftShadows};

/// See the module.
#[derive(Debug)]
pub(super) struct LampPass {
    gpu: Gpu,
    soft: SoftShadows,
    seen: FullscreenPass,
    hidden: Option<Hidden>,
}

/// What was drawn last, of what.
#[derive(Debug)]
struct Hidden {
    target: wgpu::Texture,
    lamps: Vec<(usize, Lamp)>,
    view: Pinhole,
    revision: (u64, u64),
}

impl LampPass {
    pub(super) fn new(gpu: &Gpu, settings: Settings) -> Result<LampPass, SurfaceError> {
        let bindings = [Binding::Uniform, Binding::FloatTexture];
        let shader = ("client/soft_seen.wgsl", "seen");
        let seen = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[SharePass::FORMAT])?;
        Ok(LampPass { gpu: gpu.clone(), soft: SoftShadows::new(gpu, settings), seen, hidden: None })
    }

    /// Adds to `shares` how much of each lamp arrives, in its channel, which is 0 so far. Everything held casts.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        lamps: &[(usize, Lamp)],
        shown: Shown<'_>,
        (view, gbuffer): (&Pinhole, &GBuffer),
        shares: &Target,
    ) -> Result<(), SurfaceError> {
        let revision = held_pass::revision(shown);
        let is_same = |drawn: &Hidden| (&drawn.view, drawn.revision, &drawn.lamps[..]) == (view, revision, lamps);
        if !self.hidden.as_ref().is_some_and(is_same) {
            let target = self.soft.target(encoder, gbuffer.size_px);
            let hidden = target.create_view(&wgpu::TextureViewDescriptor::default());
            let receivers = Receivers { gbuffer, held: shown.held, view };
            for (channel, lamp) in lamps {
                let count = Count::Share { hidden: &hidden, channel: *channel };
                self.soft.encode(encoder, (lamp, shown.surfaces), receivers, count)?;
            }
            self.hidden = Some(Hidden { target, lamps: lamps.to_vec(), view: *view, revision });
        }
        let Some(Hidden { target, .. }) = &self.hidden else { return Ok(()) };
        let hidden = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut channels = [0.0_f32; CHANNELS];
        lamps.iter().for_each(|(channel, _)| channels[*channel] = 1.0);
        let channels = uniform(&self.gpu, "lamps", bytemuck::bytes_of(&channels));
        let inputs = [channels.as_entire_binding(), BindingResource::TextureView(&hidden)];
        self.seen.encode(encoder, &inputs, &[&shares.view]);
        Ok(())
    }
}
