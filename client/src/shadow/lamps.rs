//! Lights with an area among those that cast: what [`crate::soft`] finds hidden, drawn again only where something changed. What a light
//! sees casts its shadows where images of that are held, else everything held does: see [`crate::light_images`].

use camera::Pinhole;
use gpu::Gpu;
use surface::{GBuffer, SurfaceError};
use wgpu::BindingResource;

use super::pass::{CHANNELS, SharePass};
use crate::frame::Shown;
use crate::fullscreen::{Binding, FullscreenPass, Onto, Target, uniform};
use crate::held_pass;
use crate::light_images::LightImages;
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
    lamps: Vec<CastingLamp>,
    view: Pinhole,
    revision: Revision,
}

/// Of the surfaces that shadows fall on, and of those that cast.
type Revision = ((u64, u64), u64);

/// A lamp that casts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CastingLamp {
    pub(super) channel: usize,
    /// Its place in the lighting.
    pub(super) light: usize,
    pub(super) lamp: Lamp,
}

impl LampPass {
    pub(super) fn new(gpu: &Gpu, settings: Settings) -> Result<LampPass, SurfaceError> {
        let bindings = [Binding::Uniform, Binding::FloatTexture];
        let shader = ("client/soft_seen.wgsl", "seen");
        let seen = FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[SharePass::FORMAT])?;
        Ok(LampPass { gpu: gpu.clone(), soft: SoftShadows::new(gpu, settings), seen, hidden: None })
    }

    /// Adds to `shares` how much of each lamp arrives, in its channel, which is 0 so far.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        lamps: &[CastingLamp],
        shown: Shown<'_>,
        (view, gbuffer): (&Pinhole, &GBuffer),
        shares: &Target,
    ) -> Result<(), SurfaceError> {
        let revision = (held_pass::revision(shown), shown.lights.map_or(0, LightImages::revision));
        let is_same = |drawn: &Hidden| (&drawn.view, drawn.revision, &drawn.lamps[..]) == (view, revision, lamps);
        if !self.hidden.as_ref().is_some_and(is_same) {
            let target = self.soft.target(encoder, gbuffer.size_px);
            let hidden = target.create_view(&wgpu::TextureViewDescriptor::default());
            let receivers = Receivers { gbuffer, held: shown.held, view };
            for CastingLamp { channel, light, lamp } in lamps {
                let count = Count::Share { hidden: &hidden, channel: *channel };
                let seen = shown.lights.and_then(|lights| lights.seen_by(*light));
                self.soft.encode(encoder, (lamp, seen.unwrap_or(shown.surfaces)), receivers, count)?;
            }
            self.hidden = Some(Hidden { target, lamps: lamps.to_vec(), view: *view, revision });
        }
        let Some(Hidden { target, .. }) = &self.hidden else { return Ok(()) };
        let hidden = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut channels = [0.0_f32; CHANNELS];
        lamps.iter().for_each(|casting| channels[casting.channel] = 1.0);
        let channels = uniform(&self.gpu, "lamps", bytemuck::bytes_of(&channels));
        let inputs = [channels.as_entire_binding(), BindingResource::TextureView(&hidden)];
        self.seen.encode(encoder, &inputs, &[&shares.view]);
        Ok(())
    }
}
