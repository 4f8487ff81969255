//! Shadows of the scene's own lights: hard ones by shadow maps that are drawn from what each light sees, and soft ones of lights with an area by
//! [`crate::draw::soft`].
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.2, shade relief
//! surfaces by "a conventional shadow map", so that they cast and receive. So it is here for all that is held: drawn as a light
//! sees it, with each texel's inverse depth kept, and a point of the view is in shadow where something lies nearer to the
//! light.
//!
//! # Which maps
//!
//! The [`LIGHTS`] lights that bring the most light to the viewer cast shadows, others none. All maps are pinholes, of
//! [`Settings::side_px`] texels a side.
//!
//! - A **directional light** has up to three, one within the other: of all that is held, and around the viewer. A pixel takes the narrowest
//!   that has it.
//! - A **spot** is one map, a **point light**, or a spot wider than 120 degrees, the faces of a cube.
//!
//! See [`protocol::shadow_views`] for where they lie. What the view cannot show, or nothing held lies in, has no map. A map is drawn again when
//! what casts, or where it is, has changed, or it looks from elsewhere.
//!
//! # The comparison
//!
//! Four texels around the place of a point are compared and weighted bilinearly (percentage-closer filtering: Reeves, Salesin,
//! Cook, *Rendering antialiased shadows with depth maps*, 1987). Each is compared not with the point's own inverse depth, but
//! with that of its tangent plane in the texel's middle, where the map was sampled; on a plane inverse depth is linear in the
//! image, so a plane does not shadow itself. A caster counts where it is nearer than that by more than the sum of
//!
//! - half of its own footprint, by which samples of one surface may lie apart ([`surface::SETBACK_FOOTPRINTS`]); the map holds
//!   it already, and what its surface rises over half a sample, up to a footprint;
//! - what the plane rises over half a texel in u and v, or over half a sample of the light's images, where these are wider: where the surface bends, the quads
//!   that were sampled of it lie so far off it. This stands for its normal, which codes and averages turn. At the
//!   grazing angle `a` the plane rises `tan a` texels a texel, and an error of `e` in the normal errs by `e / cos² a`: less
//!   than half a `tan a` as long as `e < sin 2a / 4`, which with normals of 8 + 8 bits (half a degree) holds up to 89 degrees;
//! - what rounding may do (`crate::draw::map_space::ROUNDING`), for a directional light an eighth of a texel with 1024 of them a side.
//!
//! So light leaks under what touches a surface by up to half a texel's shadow on it, and half of a sample.
//!
//! # Limits
//!
//! What a light sees casts ([`crate::draw::light_images`]); until a server has said what that is, everything held does, and what was never
//! sampled casts nothing. Everything that a light sees casts, glass and surfaces without lights too. What mirrors and glass show is lit without shadows. What moves casts from
//! where it is, but the frames follow where it was captured. Objects that reliefs show are among what a light sees; they receive like the rest.

mod lamps;
mod maps;
mod pass;

use ::camera::Pinhole;
use glam::DVec3;
use gpu::Gpu;
use protocol::{Lighting, message};
use surface::{GBuffer, Smoothing, SurfaceError};

use crate::draw::fullscreen::Target;
use crate::draw::held_pass::{self, HeldPass};
use crate::draw::shares::LightShares;
use crate::draw::shown::Shown;
use crate::draw::soft::{self, Lamp, Receivers};
pub use lamps::SoftProgress;
use lamps::{CastingLamp, LampPass};
use pass::{CHANNELS, Map, Maps, SharePass};

/// The most lights that cast shadows.
pub const LIGHTS: usize = Lighting::MAX_CASTING;
// A channel each.
const _: () = assert!(LIGHTS == CHANNELS);

/// What casts shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shadows {
    /// Nothing: every light arrives everywhere.
    #[default]
    None,
    /// What lights see, by shadow maps; lights with an area cast from their middles.
    Maps,
    /// The same, but lights with an area cast soft shadows.
    Soft,
}

impl From<Shadows> for message::Shadows {
    fn from(shadows: Shadows) -> message::Shadows {
        match shadows {
            Shadows::None => message::Shadows::None,
            Shadows::Maps => message::Shadows::Hard,
            Shadows::Soft => message::Shadows::Soft,
        }
    }
}

/// How shadows are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// By what.
    pub shadows: Shadows,
    /// Texels of a map's side, at least 16 and as many as the device draws at most. A map takes 4 bytes a texel, and all together 20 more.
    pub side_px: u32,
    /// How lights with an area cast, by [`Shadows::Soft`].
    pub soft: soft::Settings,
}

impl Settings {
    /// Whether anything casts.
    pub fn casts(&self) -> bool {
        self.shadows != Shadows::None
    }

    /// Whether lights with an area cast soft shadows.
    pub fn is_soft(&self) -> bool {
        self.shadows == Shadows::Soft
    }
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { shadows: Shadows::None, side_px: 1024, soft: soft::Settings::default() }
    }
}

/// Draws shadows of the surfaces in a G-buffer. Nothing is made before a light casts.
#[derive(Debug)]
pub(crate) struct ShadowRenderer {
    gpu: Gpu,
    settings: Settings,
    passes: Option<Passes>,
    /// Drawn maps, also some that the last frame had no use for.
    maps: Vec<ShadowMap>,
    shares: Option<Target>,
    /// Those that cast in the last frame, by channel.
    lights: Vec<usize>,
    /// Whether there were lamps among them.
    has_lamps: bool,
}

#[derive(Debug)]
struct Passes {
    casting: HeldPass,
    shares: SharePass,
    /// Made when a lamp first casts.
    lamps: Option<LampPass>,
}

/// By what a light casts.
#[derive(Debug)]
enum Caster {
    /// By maps of these views.
    Maps(Vec<Pinhole>),
    /// By its points.
    Lamp(Lamp),
}

impl Caster {
    fn views(&self) -> &[Pinhole] {
        match self {
            Caster::Maps(views) => views,
            Caster::Lamp(_) => &[],
        }
    }
}

#[derive(Debug)]
struct ShadowMap {
    /// Of which `w` is the map; the rest is shared by all.
    gbuffer: GBuffer,
    /// Light and view.
    of: (usize, Pinhole),
    /// Of what it shows.
    revision: held_pass::Revision,
}

impl ShadowRenderer {
    /// `None` where nothing is to cast.
    pub(crate) fn new(gpu: &Gpu, settings: Settings) -> Option<ShadowRenderer> {
        let (passes, maps, shares, lights) = (None, Vec::new(), None, Vec::new());
        let side_px = settings.side_px.clamp(16, gpu.device.limits().max_texture_dimension_2d);
        let settings = Settings { side_px, ..settings };
        let renderer = ShadowRenderer { gpu: gpu.clone(), settings, passes, maps, shares, lights, has_lamps: false };
        settings.casts().then_some(renderer)
    }

    /// Draws what the lights see, where it changed, and how much of each arrives at the pixels of a G-buffer.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: Shown<'_>,
        view: &Pinhole,
        gbuffer: &GBuffer,
    ) -> Result<(), SurfaceError> {
        let wanted = self.wanted(shown, view);
        self.lights = wanted.iter().map(|(light, _)| *light).collect();
        self.has_lamps = wanted.iter().any(|(_, caster)| matches!(caster, Caster::Lamp(_)));
        if wanted.is_empty() {
            return Ok(());
        }
        if self.passes.is_none() {
            let (casting, shares) = (HeldPass::casting(&self.gpu)?, SharePass::new(&self.gpu)?);
            self.passes = Some(Passes { casting, shares, lamps: None });
        }
        self.draw_maps(encoder, shown, &wanted);
        let kept =
            self.shares.take().filter(|target| (target.texture.width(), target.texture.height()) == gbuffer.size_px);
        let shares = kept.unwrap_or_else(|| Target::new(&self.gpu, "light shares", gbuffer.size_px, SharePass::FORMAT));
        let maps: Vec<Maps<'_>> = wanted.iter().map(|(light, caster)| self.maps_of(shown, *light, caster)).collect();
        let lamp = |(channel, (light, caster)): (usize, &(usize, Caster))| match caster {
            Caster::Lamp(lamp) => Some(CastingLamp { channel, light: *light, lamp: *lamp }),
            Caster::Maps(_) => None,
        };
        let lamps: Vec<CastingLamp> = wanted.iter().enumerate().filter_map(lamp).collect();
        if let Some(passes) = &self.passes {
            passes.shares.encode(encoder, (gbuffer, shown.held, view), &maps, &shares);
        }
        if let Some(passes) = self.passes.as_mut().filter(|_| self.has_lamps) {
            let pass = match &mut passes.lamps {
                Some(pass) => pass,
                None => passes.lamps.insert(LampPass::new(&self.gpu, self.settings.soft)?),
            };
            pass.encode(encoder, &lamps, shown, Receivers { gbuffer, held: shown.held, view }, &shares)?;
        }
        self.shares = Some(shares);
        Ok(())
    }

    /// Maps and shares by what they hold.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = (&'static str, &wgpu::Texture)> {
        let maps = self.maps.iter().map(|map| ("shadow map", &map.gbuffer.w));
        let hidden = self.passes.iter().filter_map(|passes| passes.lamps.as_ref()?.hidden());
        let shares = self.shares.iter().map(|shares| ("light shares", &shares.texture));
        maps.chain(hidden.map(|hidden| ("hidden light", hidden))).chain(shares)
    }

    /// How far soft shadows got; `None` where no lamp casts.
    pub(crate) fn soft_progress(&self) -> Option<SoftProgress> {
        self.passes.as_ref()?.lamps.as_ref().filter(|_| self.has_lamps)?.progress()
    }

    /// Whether a light ever cast.
    pub(crate) fn is_made(&self) -> bool {
        self.passes.is_some()
    }

    /// What was written last; `None` where nothing casts.
    pub(crate) fn shares(&self) -> Option<LightShares<'_>> {
        let target = self.shares.as_ref().filter(|_| !self.lights.is_empty())?;
        Some(LightShares { target, lights: &self.lights })
    }

    /// The lights that cast, the strongest first, by their places in the lighting, and by what they do.
    fn wanted(&self, shown: Shown<'_>, view: &Pinhole) -> Vec<(usize, Caster)> {
        let Some((lighting, bounds)) = shown.held.lighting.as_ref().zip(held_pass::bounds_world(shown)) else {
            return Vec::new();
        };
        if shown.held.materials.iter().all(|material| material.unlit) {
            return Vec::new();
        }
        let caster = |index: usize| {
            let light = &lighting.lights[index];
            if let Some(lamp) = Lamp::of(light).filter(|_| self.settings.is_soft()) {
                return Some((index, Caster::Lamp(lamp)));
            }
            let views = maps::views(light, bounds, view, self.settings.side_px);
            (!views.is_empty()).then_some((index, Caster::Maps(views)))
        };
        let lights = lighting.strongest_at(view.world_from_eye.translation);
        lights.into_iter().filter_map(caster).take(LIGHTS).collect()
    }

    /// Draws the views that no map shows as they are now, in place of maps that are of no use to any of them.
    fn draw_maps(&mut self, encoder: &mut wgpu::CommandEncoder, shown: Shown<'_>, wanted: &[(usize, Caster)]) {
        let all = wanted.iter().flat_map(|(light, caster)| caster.views().iter().map(|view| (*light, *view)));
        let all: Vec<(usize, Pinhole)> = all.collect();
        for &(light, view) in &all {
            let casting = casting(shown, light);
            let revision = held_pass::revision(casting);
            let place = self.maps.iter().position(|map| map.of == (light, view));
            if place.is_some_and(|place| self.maps[place].revision == revision) {
                continue;
            }
            let spare = place.or_else(|| self.maps.iter().position(|map| !all.contains(&map.of)));
            let gbuffer = match (spare, self.maps.first()) {
                (Some(place), _) => self.maps.swap_remove(place).gbuffer,
                (None, Some(other)) => other.gbuffer.beside(&self.gpu),
                (None, None) => GBuffer::new(&self.gpu, (self.settings.side_px, self.settings.side_px)),
            };
            if let Some(passes) = &mut self.passes {
                passes.casting.encode(encoder, casting, &view, Smoothing::None, &gbuffer);
            }
            self.maps.push(ShadowMap { gbuffer, of: (light, view), revision });
        }
    }

    /// The maps of a light, which were drawn before.
    fn maps_of<'a>(&'a self, shown: Shown<'_>, light: usize, caster: &'a Caster) -> Maps<'a> {
        let map = |view: &'a Pinhole| {
            let drawn = self.maps.iter().find(|map| map.of == (light, *view))?;
            Some(Map { view, w: &drawn.gbuffer.views.w, sample_texels: sample_texels(shown, light, view) })
        };
        caster.views().iter().filter_map(map).collect()
    }
}

/// How many texels of a map a sample of what casts is wide, in the map's middle; 1 where samples are narrower, or it is not known.
fn sample_texels(shown: Shown<'_>, light: usize, view: &Pinhole) -> f32 {
    // Of a light from afar, the middle of its ball; near depths are half of that.
    let depth_m = 2.0 * view.near_m;
    let middle_world = view.world_from_eye.transform_point(DVec3::Z * depth_m);
    let sample_m = shown.lights.and_then(|lights| lights.sample_m(light, middle_world));
    sample_m.map_or(1.0, |sample_m| (sample_m * view.focal_px / depth_m).max(1.0) as f32)
}

/// What casts a light's shadows: what it sees, where images of that are held, objects that reliefs show among it; else all that is held.
fn casting(shown: Shown<'_>, light: usize) -> Shown<'_> {
    let seen = shown.lights.and_then(|lights| lights.seen_by(light));
    seen.map_or(shown, |surfaces| Shown { surfaces, impostors: None, ..shown })
}
