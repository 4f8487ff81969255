//! Soft shadows of lights with an area: the share of the light's points that each pixel sees, by surfaces that are rebuilt from samples.
//!
//! Method: Xie, Wang, Popescu, *Non-redundant rendering for efficient multi-view scene discretization*, 2016, section 5 and Alg. 5: the
//! scene is sampled from the four corners of the light, surfaces are rebuilt from the samples, and visibility is estimated from each of
//! `n x n` points of the light. The eye moves freely: nothing here depends on where it is but the pixels that are asked for.
//! In frames that is what a server sent of each light ([`crate::draw::light_images`]), which it keeps as the scene is now.
//! **Deviation**: of a light without such images all samples that a client holds cast ([`crate::draw::shadow`]; objects that reliefs show do not).
//!
//! All points of a light look the same way with the same scale ([`camera::parallel_views`]); a **lamp** ([`Lamp`]) is a light with those views.
//!
//! [`Method`] says how the visibility of a point is found:
//!
//! | method | of each of the light's points |
//! |---|---|
//! | [`Method::Maps`] | a shadow map is drawn from the rebuilt surfaces: the paper's |
//! | [`Method::Warp`] | the same map is written by a compute shader, many points at once |
//! | [`Method::March`] | a ray is followed through the images of the lamp's corners: no map |
//!
//! Casters that can hide nothing that is seen are left out of the latter (`reach`). A frame may draw some of the points only, and the next ones
//! more of them: [`Pace`]; meanwhile a filter that stops at edges evens out their steps (`smooth`). Which method frames come faster with is
//! found out by trying: [`Choice`].
//!
//! # The comparison
//!
//! A pixel's point is compared with the one texel of a map that it lies in, by the rule of [`crate::draw::shadow`]: its tangent plane in the texel's
//! middle against the caster's inverse depth, less half of the caster's footprint, what the plane rises over half a texel, and
//! rounding. One texel and not four: a light's many points smooth by themselves, and each of them sees or does not.

mod batch;
mod bias;
mod choice;
mod compare;
mod count;
mod maps;
mod march;
mod method;
pub(crate) mod pace;
mod reach;
mod receivers;
mod smooth;
mod warp;

use std::ops::Range;

use camera::Bounds;
use gpu::Gpu;
use surface::{HeldSurfaces, SurfaceError};

pub use bias::Bias;
pub use choice::Choice;
pub use count::Count;
pub use method::Method;
pub use pace::Pace;
pub use protocol::Lamp;
pub use receivers::Receivers;

use crate::draw::fullscreen::Target;
use compare::ComparePass;
use maps::PointMaps;
use march::PointMarch;
use smooth::SmoothPass;
use warp::PointWarps;

/// How soft shadows are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// By what.
    pub choice: Choice,
    /// A light is `points * points` points; at most [`Settings::MAX_POINTS`].
    pub points: u32,
    /// A map has as many texels as a square of this side.
    pub map_px: u32,
    /// How much nearer than a point hides it.
    pub bias: Bias,
    /// How many of the points a frame draws.
    pub pace: Pace,
}

impl Settings {
    /// Shares are sums of equal parts, which 16-bit floats hold exactly up to 2,048 of them where their number is a power of two.
    pub const MAX_POINTS: u32 = 32;
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { choice: Choice::default(), points: 8, map_px: 512, bias: Bias::default(), pace: Pace::All }
    }
}

/// Surfaces that cast.
#[derive(Debug, Clone, Copy)]
pub struct Casters<'a> {
    /// Those.
    pub surfaces: &'a HeldSurfaces,
    /// A box around them, which maps hold: of the same box, maps of a lamp's points lie the same whatever casts.
    pub bounds_world: Bounds,
}

impl<'a> Casters<'a> {
    /// All of a store's, in the smallest box; `None` where it has none.
    pub fn of(surfaces: &'a HeldSurfaces) -> Option<Casters<'a>> {
        surfaces.bounds_world().map(|bounds_world| Casters { surfaces, bounds_world })
    }
}

/// Draws how much of a lamp is hidden. Pipelines are made when a lamp first casts.
#[derive(Debug)]
pub struct SoftShadows {
    gpu: Gpu,
    settings: Settings,
    method: Method,
    /// In which points are drawn.
    order: Vec<usize>,
    passes: Passes,
    smooth: Option<SmoothPass>,
}

/// Each made when it is first needed.
#[derive(Debug, Default)]
struct Passes {
    maps: Option<(PointMaps, ComparePass)>,
    warps: Option<PointWarps>,
    march: Option<PointMarch>,
}

impl SoftShadows {
    /// Of what is drawn.
    pub const FORMAT: wgpu::TextureFormat = Count::FORMAT;

    /// Makes nothing yet.
    pub fn new(gpu: &Gpu, settings: Settings) -> SoftShadows {
        let points = settings.points.clamp(1, Settings::MAX_POINTS);
        // Twice as long as that, and two texels more, is the longest map.
        let map_px = settings.map_px.clamp(16, gpu.device.limits().max_texture_dimension_2d / 2 - 1);
        let order = pace::order(points);
        SoftShadows {
            gpu: gpu.clone(),
            settings: Settings { points, map_px, ..settings },
            method: settings.choice.first(gpu.caps.compute),
            order,
            passes: Passes::default(),
            smooth: None,
        }
    }

    /// A lamp's points.
    pub fn points(&self) -> usize {
        self.order.len()
    }

    /// Draws by another method from now on; what the former one needs is given back.
    pub fn draw_by(&mut self, method: Method) {
        if method != self.method {
            (self.method, self.passes) = (method, Passes::default());
        }
    }

    /// The numbers of the points whose turn it is, ascending.
    pub fn numbers(&self, turns: Range<usize>) -> Vec<usize> {
        let mut numbers = self.order[turns].to_vec();
        numbers.sort_unstable();
        numbers
    }

    /// Counts, at each pixel, the points of a lamp that `casters` hide from it: those whose turn it is, of [`SoftShadows::points`] in an order in
    /// which any first few lie evenly. Points are numbered as [`protocol::Area::points_world`] gives them. Tells by which method; `None` where
    /// nothing is hidden from any.
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (lamp, casters): (&Lamp, Casters<'_>),
        receivers: Receivers<'_>,
        (count, turns): (Count<'_>, Range<usize>),
    ) -> Result<Option<Method>, SurfaceError> {
        let Casters { surfaces: casters, bounds_world } = casters;
        let faces = lamp.views(bounds_world, self.settings.points, self.settings.map_px);
        let points = self.numbers(turns);
        if self.method == Method::March
            && let [face] = &*faces
            && let [corners] = &*lamp.corner_views(bounds_world, self.settings.map_px)
            && PointWarps::may_warp(corners)
        {
            let march = made(&mut self.passes.march, || PointMarch::new(&self.gpu, self.settings.bias))?;
            march.encode(encoder, (corners, face, casters), receivers, (count, &points));
            return Ok(Some(Method::March));
        }
        let mut drawn_by = None;
        for face in &faces {
            if self.method == Method::Warp && self.gpu.caps.compute && PointWarps::may_warp(face) {
                let warps = made(&mut self.passes.warps, || PointWarps::new(&self.gpu, self.settings.bias))?;
                if warps.has_room_for(casters) {
                    warps.encode(encoder, (face, casters), receivers, (count, &points));
                    drawn_by = Some(Method::Warp);
                    continue;
                }
            }
            let make = || Ok((PointMaps::new(&self.gpu)?, ComparePass::new(&self.gpu, self.settings.bias)?));
            let (maps, compare) = made(&mut self.passes.maps, make)?;
            let ready = compare.prepare(receivers);
            for &point in &points {
                let map = &face[point];
                let target = maps.draw(encoder, casters, map);
                let (hidden, weights) = count.of(point, face.len());
                compare.encode(encoder, &ready, (map, target), weights, hidden);
            }
            drawn_by = Some(Method::Maps);
        }
        Ok(drawn_by)
    }

    /// What is shown of shares ([`Count::Share`]) of which `drawn` points were counted so far: those of all points as they are, those of fewer evened
    /// out along each surface.
    pub fn shown(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (hidden, drawn): (&wgpu::TextureView, usize),
        receivers: Receivers<'_>,
    ) -> Result<wgpu::TextureView, SurfaceError> {
        if drawn >= self.points() {
            return Ok(hidden.clone());
        }
        let points = self.points();
        let smooth = made(&mut self.smooth, || Ok(SmoothPass::new(&self.gpu)?))?;
        Ok(smooth.encode(encoder, (hidden, points), receivers))
    }

    /// A target for [`SoftShadows::encode`], all zero.
    pub fn target(&self, encoder: &mut wgpu::CommandEncoder, size_px: (u32, u32)) -> wgpu::Texture {
        let target = Target::new(&self.gpu, "hidden light", size_px, SoftShadows::FORMAT);
        drop(crate::draw::fullscreen::begin(encoder, "nothing hidden", true, &[&target.view], None));
        target.texture
    }
}

/// What is there, or is made now.
fn made<T>(slot: &mut Option<T>, make: impl FnOnce() -> Result<T, SurfaceError>) -> Result<&mut T, SurfaceError> {
    match slot {
        Some(made) => Ok(made),
        None => Ok(slot.insert(make()?)),
    }
}
