//! From where a light is looked from.

use camera::{Bounds, Pinhole};
use glam::DVec3;
use protocol::message::Shadows;
use protocol::{Lamp, Light, Viewpoint, shadow_views};

use super::places::{self, Places};

/// No light counts where it brings less irradiance than this: of a white wall at 5 ([`crate::look::TYPICAL_IRRADIANCE`]) it is less than a
/// step of eight bits.
const LEAST_IRRADIANCE: f64 = 0.01;

/// How a light casts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Caster<'a> {
    light: &'a Light,
    /// What it casts from all of; without, it casts as from its middle, or from afar.
    lamp: Option<Lamp>,
}

/// The views of a light, a row of those that see the same things; one of each row, and so a *turn*, is looked from at a time.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Views(pub Vec<Vec<Pinhole>>);

impl<'a> Caster<'a> {
    /// For a client that draws such shadows.
    pub fn of(light: &'a Light, shadows: Shadows) -> Caster<'a> {
        Caster { light, lamp: Lamp::of(light).filter(|_| shadows == Shadows::Soft) }
    }

    /// Whether it casts from all of an area.
    pub fn is_lamp(&self) -> bool {
        self.lamp.is_some()
    }

    /// Its views of what of a box it may reach. A row is the places of a lamp, the frames of a light from afar, or one face.
    pub fn views(&self, all: Bounds, viewer: Viewpoint, places: &Places, side_px: u32) -> Views {
        let Some(bounds) = self.lit_part(all) else { return Views::default() };
        if let Some(lamp) = self.lamp {
            return Views(places.views(&lamp, bounds, side_px));
        }
        let views = shadow_views(self.light, bounds, viewer, side_px);
        match self.light {
            Light::Directional { .. } => Views(vec![views]),
            Light::Point { .. } => Views(views.into_iter().map(|view| vec![view]).collect()),
        }
    }

    /// The views of all points of a lamp that come into question, face by face; none of a light without an area.
    pub fn all_views(&self, all: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
        let lamp_and_bounds = self.lamp.zip(self.lit_part(all));
        lamp_and_bounds.map_or_else(Vec::new, |(lamp, bounds)| places::all_views(&lamp, bounds, side_px))
    }

    /// The part of a box that the light may reach; `None` where that is nothing.
    fn lit_part(&self, all: Bounds) -> Option<Bounds> {
        let Light::Point { position_world, intensity, range_m, .. } = self.light else { return Some(all) };
        let middle_world = DVec3::from(*position_world);
        let half_m =
            self.lamp.map(|lamp| lamp.area.half_world.map(|half| DVec3::from(half).length()).iter().sum::<f64>());
        let strongest = intensity.iter().copied().fold(0.0, f32::max);
        let reach_m = f64::from(*range_m).min((f64::from(strongest) / LEAST_IRRADIANCE).sqrt());
        let around = DVec3::splat(half_m.unwrap_or(0.0) + reach_m);
        let bounds = Bounds { min: all.min.max(middle_world - around), max: all.max.min(middle_world + around) };
        bounds.min.cmple(bounds.max).all().then_some(bounds)
    }
}

impl Views {
    /// How many turns it takes to look from all of them.
    pub fn turns(&self) -> usize {
        self.0.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// What is looked from at a turn.
    pub fn at(&self, turn: usize) -> Vec<Pinhole> {
        self.0.iter().filter_map(|row| row.get(turn).copied()).collect()
    }

    /// The turns that look from where none of `before` does.
    pub fn new_turns(&self, before: &Views) -> impl Iterator<Item = usize> {
        let is_new = |view: &Pinhole| !before.0.iter().flatten().any(|known| known == view);
        (0..self.turns()).filter(move |turn| self.at(*turn).iter().any(is_new))
    }
}
