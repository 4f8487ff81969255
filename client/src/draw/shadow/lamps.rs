//! Lights with an area among those that cast: what [`crate::draw::soft`] finds hidden, drawn again only where something changed,
//! and more of its points while nothing does ([`soft::Pace`](crate::draw::soft::Pace)). What a light
//! sees casts its shadows where images of that are held, else everything held does: see [`crate::draw::light_images`].

use std::fmt;

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use surface::SurfaceError;
use web_time::Instant;
use wgpu::BindingResource;

use super::pass::{CHANNELS, SharePass};
use crate::draw::fullscreen::{Binding, FullscreenPass, Onto, Target, uniform};
use crate::draw::held_pass;
use crate::draw::light_images::LightImages;
use crate::draw::rest::RestView;
use crate::draw::shown::Shown;
use crate::draw::soft::pace::Pacer;
use crate::draw::soft::{Casters, Count, Lamp, Method, Receivers, Settings, SoftShadows};

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
    /// By what they were to be.
    method: Method,
    /// By what the first lamp's were.
    drawn_by: Option<Method>,
}

/// `Lamps` of `client/soft_seen.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct LampsUniform {
    channels: [f32; 4],
    all_of_drawn: f32,
    padding: [f32; 3],
}

/// Of the surfaces that shadows fall on, of those that cast, and of a view at rest that is shown in their place.
type Revision = (held_pass::Revision, u64, u64);

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
        let soft = SoftShadows::new(gpu, settings);
        let pacer = Pacer::new(settings.pace, settings.choice, gpu.caps.compute);
        Ok(LampPass { gpu: gpu.clone(), soft, pacer, seen, hidden: None })
    }

    /// How much of each lamp is hidden, a channel a lamp.
    pub(super) fn hidden(&self) -> Option<&wgpu::Texture> {
        self.hidden.as_ref().map(|hidden| &hidden.target)
    }

    /// Adds to `shares` how much of each lamp arrives, in its channel, which is 0 so far.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        lamps: &[CastingLamp],
        shown: Shown<'_>,
        receivers: Receivers<'_>,
        shares: &Target,
    ) -> Result<(), SurfaceError> {
        let hidden = self.draw(encoder, lamps, shown, receivers)?;
        let target = hidden.target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut channels = [0.0_f32; CHANNELS];
        lamps.iter().for_each(|casting| channels[casting.channel] = 1.0);
        let all_of_drawn = self.soft.points() as f32 / hidden.points as f32;
        let lamps = LampsUniform { channels, all_of_drawn, padding: [0.0; 3] };
        let lamps = uniform(&self.gpu, "lamps", bytemuck::bytes_of(&lamps));
        let smooth = self.soft.shown(encoder, (&target, hidden.points), receivers)?;
        let inputs = [lamps.as_entire_binding(), BindingResource::TextureView(&smooth)];
        self.seen.encode(encoder, &inputs, &[&shares.view]);
        self.hidden = Some(hidden);
        Ok(())
    }

    /// Draws the points whose turn it is, onto those that were drawn before of the same.
    fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        lamps: &[CastingLamp],
        shown: Shown<'_>,
        receivers: Receivers<'_>,
    ) -> Result<Hidden, SurfaceError> {
        let view = receivers.view;
        let (casters, at_rest) =
            (shown.lights.map_or(0, LightImages::revision), shown.rest.map_or(0, RestView::revision));
        let revision = (held_pass::revision(shown), casters, at_rest);
        let is_same = |drawn: &Hidden| (&drawn.view, drawn.revision, &drawn.lamps[..]) == (view, revision, lamps);
        let before = self.hidden.take();
        if before.as_ref().is_some_and(|drawn| drawn.lamps.len() != lamps.len() || drawn.size_px() != size_of(view)) {
            self.pacer.begin_again();
        }
        let all = self.soft.points();
        let before = match before.filter(is_same) {
            Some(all_drawn) if all_drawn.points >= all => {
                self.pacer.rest();
                return Ok(all_drawn);
            }
            before => before,
        };
        let (some, method) = self.pacer.next(Instant::now(), all as u32);
        self.soft.draw_by(method);
        let mut hidden = before.filter(|drawn| drawn.method == method).unwrap_or_else(|| Hidden {
            target: self.soft.target(encoder, size_of(view)),
            lamps: lamps.to_vec(),
            view: *view,
            revision,
            points: 0,
            method,
            drawn_by: None,
        });
        let target = hidden.target.create_view(&wgpu::TextureViewDescriptor::default());
        let turns = hidden.points..all.min(hidden.points + some as usize);
        for CastingLamp { channel, light, lamp } in lamps {
            let count = Count::Share { hidden: &target, channel: *channel };
            let seen = shown.lights.and_then(|lights| lights.seen_by(*light));
            let Some(casters) = Casters::of(seen.unwrap_or(shown.surfaces)) else { continue };
            let drawn_by = self.soft.encode(encoder, (lamp, casters), receivers, (count, turns.clone()))?;
            hidden.drawn_by = hidden.drawn_by.or(drawn_by);
        }
        if turns.len() < some as usize {
            // The last few: they tell too little of how long a frame takes.
            self.pacer.rest();
        }
        hidden.points = turns.end;
        Ok(hidden)
    }

    /// How far the last frame got; `None` before any.
    pub(super) fn progress(&self) -> Option<SoftProgress> {
        let hidden = self.hidden.as_ref()?;
        Some(SoftProgress { points: hidden.points, of: self.soft.points(), method: hidden.drawn_by })
    }
}

impl Hidden {
    fn size_px(&self) -> (u32, u32) {
        size_of(&self.view)
    }
}

fn size_of(view: &Pinhole) -> (u32, u32) {
    (view.width_px, view.height_px)
}

/// How many of a lamp's points a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SoftProgress {
    /// So many.
    pub points: usize,
    /// When all are drawn.
    pub of: usize,
    /// By which method they were drawn; `None` where no point is hidden from anything.
    pub method: Option<Method>,
}

impl fmt::Display for SoftProgress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.points, self.of)?;
        self.method.map_or(Ok(()), |method| write!(f, ", {method}"))
    }
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
