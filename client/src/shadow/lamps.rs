//! Lights with an area among those that cast: what [`crate::soft`] finds hidden, drawn again only where something changed,
//! and more of its points while nothing does ([`soft::Pace`](crate::soft::Pace)). What a light
//! sees casts its shadows where images of that are held, else everything held does: see [`crate::light_images`].

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use surface::{GBuffer, SurfaceError};
use web_time::Instant;
use wgpu::BindingResource;

use super::pass::{CHANNELS, SharePass};
use crate::frame::Shown;
use crate::fullscreen::{Binding, FullscreenPass, Onto, Target, uniform};
use crate::held_pass;
use crate::light_images::LightImages;
use crate::soft::pace::Pacer;
use crate::soft::{Casters, Count, Lamp, Receivers, Settings, SoftShadows};

/// See the module.
#[derive(Debug)]
pub(super) struct LampPass {
    gpu: Gpu,
    soft: SoftShadows,
    pacer: Pacer,
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
    /// Points of each lamp that were drawn.
    points: usize,
}

/// `Lamps` of `client/soft_seen.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct LampsUniform {
    channels: [f32; 4],
    all_of_drawn: f32,
    padding: [f32; 3],
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
        let (soft, pacer) = (SoftShadows::new(gpu, settings), Pacer::new(settings.pace));
        Ok(LampPass { gpu: gpu.clone(), soft, pacer, seen, hidden: None })
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
        let all = self.soft.points();
        let mut hidden = self.hidden.take().filter(is_same).unwrap_or_else(|| Hidden {
            target: self.soft.target(encoder, gbuffer.size_px),
            lamps: lamps.to_vec(),
            view: *view,
            revision,
            points: 0,
        });
        let target = hidden.target.create_view(&wgpu::TextureViewDescriptor::default());
        let receivers = Receivers { gbuffer, held: shown.held, view };
        if hidden.points < all {
            let some = self.pacer.next(Instant::now(), all as u32) as usize;
            let turns = hidden.points..all.min(hidden.points + some);
            for CastingLamp { channel, light, lamp } in lamps {
                let count = Count::Share { hidden: &target, channel: *channel };
                let seen = shown.lights.and_then(|lights| lights.seen_by(*light));
                let Some(casters) = Casters::of(seen.unwrap_or(shown.surfaces)) else { continue };
                self.soft.encode(encoder, (lamp, casters), receivers, (count, turns.clone()))?;
            }
            hidden.points = turns.end;
        } else {
            self.pacer.rest();
        }
        let mut channels = [0.0_f32; CHANNELS];
        lamps.iter().for_each(|casting| channels[casting.channel] = 1.0);
        let all_of_drawn = all as f32 / hidden.points as f32;
        let lamps = LampsUniform { channels, all_of_drawn, padding: [0.0; 3] };
        let lamps = uniform(&self.gpu, "lamps", bytemuck::bytes_of(&lamps));
        let smooth = self.soft.shown(encoder, (&target, hidden.points), receivers)?;
        let inputs = [lamps.as_entire_binding(), BindingResource::TextureView(&smooth)];
        self.seen.encode(encoder, &inputs, &[&shares.view]);
        self.hidden = Some(hidden);
        Ok(())
    }

    /// How far the last frame got; `None` before any.
    pub(super) fn progress(&self) -> Option<SoftProgress> {
        let hidden = self.hidden.as_ref()?;
        Some(SoftProgress { points: hidden.points, of: self.soft.points() })
    }
}

/// How many of a lamp's points a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SoftProgress {
    /// So many.
    pub points: usize,
    /// When all are drawn.
    pub of: usize,
}

impl SoftProgress {
    /// Whether the next frame will show more, though nothing moves.
    pub fn goes_on(self) -> bool {
        self.points < self.of
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(LampsUniform, "client/soft_seen.wgsl", "Lamps", channels, all_of_drawn);
    }
}
