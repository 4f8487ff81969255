//! Sends what lights see, and keeps it as it is now.

use std::collections::BTreeSet;
use std::sync::Arc;

use camera::{Bounds, Pinhole};
use glam::{DVec3, Vec3};
use protocol::{Lamp, Light, Purpose};
use scene::{Scene, Snapshot};

use super::kept::{CORNERS, Kept, KeptLight, Set};
use crate::account::findings::Lacking;
use crate::account::{Account, AccountRules, Surroundings};
use crate::discretize::{DepthPrecision, Discretization};
use crate::imager::Imager;
use crate::plan::PARALLAX_ERROR_PX;
use crate::revise::{Revision, revise};
use crate::stage_error::StageError;

/// A probe has as many pixels as a square of this side: a teapot on a table under a lamp is thirty of them wide, its spout two.
const PROBE_PX: u32 = 128;
/// No light counts where it brings less irradiance than this: of a white wall at 5 ([`crate::look::TYPICAL_IRRADIANCE`]) it is less than a
/// step of eight bits.
const LEAST_IRRADIANCE: f64 = 0.01;
/// What covers falsely is trimmed at every so manieth look of a light. As corners take turns, no divisor of their number.
const TRIM_EVERY: usize = 5;
/// A set may grow to this many times the samples that it began with; then what no corner saw for the longest goes.
const GROWS_TO: usize = 2;

/// What serves the lights of one client at a time.
pub struct Serving<'a> {
    /// What is there.
    pub scene: &'a Scene,
    /// Where it is.
    pub snapshot: &'a Arc<Snapshot>,
    /// The tables, lights and poses.
    pub now: &'a Surroundings<'a>,
    /// What decides about samples.
    pub rules: AccountRules,
    /// Images have as many pixels as a square of this side.
    pub side_px: u32,
    /// What the client holds.
    pub account: &'a mut Account,
    /// Sees the scene.
    pub imager: &'a mut dyn Imager,
}

/// Sends a client what the lamps see that it draws, or what of that changed.
pub fn serve(mut serving: Serving<'_>, kept: &mut Kept, eye_world: DVec3) -> Result<(), StageError> {
    let wanted = kept.wanted(serving.now.lighting, eye_world);
    for other in kept.drop_others(&wanted) {
        serving.account.remove_where(|purpose| purpose == Purpose::Light(other))?;
    }
    // What reliefs show to the eye casts like everything else.
    serving.imager.leave_out(BTreeSet::new());
    for (light, lamp) in wanted {
        serving.serve(light, lamp, kept)?;
    }
    if let Some(news) = kept.news() {
        tracing::info!("lights: {news}");
    }
    Ok(())
}

impl Serving<'_> {
    fn serve(&mut self, light: u16, lamp: Lamp, kept: &mut Kept) -> Result<(), StageError> {
        let Some(known) = kept.lights.get_mut(&light) else {
            let set = self.begin(light, lamp, false)?;
            kept.lights.insert(light, KeptLight::new(lamp, self.snapshot, set));
            return Ok(());
        };
        let moved = known.moved(lamp, self.scene, self.snapshot);
        match &mut known.set {
            Some(set) => {
                if moved {
                    set.due = CORNERS;
                }
                if set.due > 0 {
                    return self.follow(light, lamp, set);
                }
                self.account.counts_mut().lights.unchanged += 1;
            }
            None if moved => known.set = self.begin(light, lamp, true)?,
            None => self.account.counts_mut().lights.without += 1,
        }
        Ok(())
    }

    /// A first set, if the light casts anything; `is_known` to cast nothing so far.
    fn begin(&mut self, light: u16, lamp: Lamp, is_known: bool) -> Result<Option<Set>, StageError> {
        let purpose = Purpose::Light(light);
        let bounds = self.bounds(light, &lamp);
        if !bounds.map_or(Ok(false), |bounds| self.casts(&lamp, bounds))? {
            self.account.counts_mut().lights.without += 1;
            if !is_known {
                self.account.add_nothing(light, self.now)?;
            }
            return Ok(None);
        }
        self.account.remove_where(|other| other == purpose)?;
        let imager = &*self.imager;
        self.account.draw_with(purpose, || imager.new_surfaces());
        let precision = bounds.map_or(DepthPrecision::Finest, |bounds| precision(&lamp, bounds, self.side_px));
        for face in bounds.map(|bounds| lamp.corner_views(bounds, self.side_px)).unwrap_or_default() {
            for mut capture in self.imager.captures(self.snapshot, &face, Discretization::COVERED)? {
                self.account.counts_mut().look_at(purpose, &capture);
                self.account.counts_mut().lights.views += 1;
                let lacking = Lacking::all(&capture);
                self.imager.tell_ends(&mut capture, &lacking.send)?;
                self.account.add(purpose, &capture, &lacking, precision, self.now)?;
            }
        }
        self.account.counts_mut().lights.sets += 1;
        Ok(Some(Set { samples: self.account.samples_for(purpose), due: 0, looks: 0 }))
    }

    /// Brings a set up to date as one corner sees it, or all of them where something deforms.
    fn follow(&mut self, light: u16, lamp: Lamp, set: &mut Set) -> Result<(), StageError> {
        let purpose = Purpose::Light(light);
        let faces = self.bounds(light, &lamp).map(|bounds| (bounds, lamp.corner_views(bounds, self.side_px)));
        let deforms = self.scene.instances.iter().any(|instance| instance.deforms);
        let corners = if deforms { CORNERS } else { 1 };
        self.account.delete_moved(purpose, self.now)?;
        if let Some((bounds, faces)) = faces {
            let precision = precision(&lamp, bounds, self.side_px);
            for _ in 0..corners {
                let views: Vec<Pinhole> = faces.iter().map(|face| face[set.looks % CORNERS]).collect();
                self.look_from(purpose, &views, set.looks, precision)?;
                set.looks += 1;
            }
        }
        set.due = set.due.saturating_sub(corners);
        Ok(self.account.evict_light(light, GROWS_TO * set.samples)?)
    }

    fn look_from(
        &mut self,
        purpose: Purpose,
        views: &[Pinhole],
        looks: usize,
        precision: DepthPrecision,
    ) -> Result<(), StageError> {
        if views.is_empty() {
            return Ok(());
        }
        for capture in &mut self.imager.captures(self.snapshot, views, Discretization::Conventional)? {
            let revision = Revision {
                purpose,
                rules: AccountRules { outlines_stand_in: true, ..self.rules },
                peers: views,
                trims: looks.is_multiple_of(TRIM_EVERY),
                supersedes: false,
                looks_again: false,
                is_seen: true,
                least_px: self.rules.least_missing * capture.ids.len() as f64,
                precision,
            };
            // The scene, and the copy.
            self.account.counts_mut().lights.views += 2;
            revise(&mut *self.imager, self.account, capture, &revision, self.now)?;
        }
        Ok(())
    }

    /// Whether a corner sees anything behind anything else.
    fn casts(&mut self, lamp: &Lamp, bounds: Bounds) -> Result<bool, StageError> {
        for view in lamp.corner_views(bounds, PROBE_PX).into_iter().flatten() {
            let layers = self.imager.captures(self.snapshot, &[view; 2], Discretization::DepthPeeling)?;
            self.account.counts_mut().lights.views += layers.len();
            if layers.get(1).is_some_and(|second| second.ids.iter().any(|ids| ids[0] != 0)) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// A box around all that a light may reach now; `None` where that is nothing.
    fn bounds(&self, light: u16, lamp: &Lamp) -> Option<Bounds> {
        let instances = (0..self.scene.instances.len()).map(|id| id as u16);
        let all = instances.filter_map(|id| self.bounds_of(id)).reduce(Bounds::union)?;
        let reach_m = self.now.lighting.lights.get(usize::from(light)).map_or(0.0, reach_m);
        let around = lamp.area.half_world.map(|half| DVec3::from(half).length()).iter().sum::<f64>() + reach_m;
        let bounds = Bounds {
            min: all.min.max(lamp.middle_world - DVec3::splat(around)),
            max: all.max.min(lamp.middle_world + DVec3::splat(around)),
        };
        bounds.min.cmple(bounds.max).all().then_some(bounds)
    }

    fn bounds_of(&self, id: u16) -> Option<Bounds> {
        let Some(deformed) = self.snapshot.deformed.iter().find(|deformed| deformed.instance == u32::from(id)) else {
            return self.scene.bounds_of(self.snapshot, id);
        };
        let world_from_mesh = self.snapshot.world_from_mesh.get(usize::from(id))?;
        let at = |vertex: &scene::Vertex| world_from_mesh.transform_point3(Vec3::from(vertex.position).as_dvec3());
        Bounds::around(deformed.vertices.iter().map(at))
    }
}

/// How far a light reaches, in metres.
fn reach_m(light: &Light) -> f64 {
    let Light::Point { intensity, range_m, .. } = light else { return f64::INFINITY };
    let strongest = intensity.iter().copied().fold(0.0, f32::max);
    f64::from(*range_m).min((f64::from(strongest) / LEAST_IRRADIANCE).sqrt())
}

/// See [the module](super): what an eye that moves as far as the farthest corner is away sees shift by a tenth of a pixel.
fn precision(lamp: &Lamp, bounds: Bounds, side_px: u32) -> DepthPrecision {
    let offset_m = bounds.corners().iter().map(|corner| corner.distance(lamp.middle_world)).fold(0.0, f64::max);
    let focal_px = lamp.corner_views(bounds, side_px).first().and_then(|face| face.first()).map(|view| view.focal_px);
    DepthPrecision::Parallax { epsilon_px: PARALLAX_ERROR_PX, focal_px: focal_px.unwrap_or(1.0), offset_m }
}
