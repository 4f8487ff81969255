//! Sends what lights see, and keeps it as it is now.

use std::sync::Arc;

use camera::{Bounds, Pinhole};
use protocol::message::Shadows;
use protocol::{Purpose, Viewpoint};
use scene::{Scene, Snapshot};

use super::caster::{Caster, Views};
use super::kept::{Kept, KeptLight, Set};
use super::places::{self, Places};
use crate::account::findings::Lacking;
use crate::account::{Account, AccountRules, Surroundings};
use crate::discretize::{DepthPrecision, Discretization};
use crate::imager::Imager;
use crate::plan::PARALLAX_ERROR_PX;
use crate::render::{Blended, LeftOut};
use crate::revise::{Revision, revise};
use crate::stage_error::StageError;
use crate::whereabouts;

/// What leaves out what an earlier image of a light holds. Samples say where their surface ends, so one image is enough of an outline; the rims
/// of several, each with its own pixels ([`Discretization::COVERED`]), together reach further than it does. Lamps over `tree` and `grass` from eight
/// points, images of 1024 x 1024, intensity errors as in the report on shadows: 1.65 and 3.04 in 3.2 and 2.2 MB, by `COVERED` 1.91 and 7.94 in
/// 4.0 and 5.2 MB.
pub const METHOD: Discretization = Discretization::FOOTPRINT;
/// A probe has as many pixels as a square of this side: a teapot on a table under a lamp is thirty of them wide, its spout two.
const PROBE_PX: u32 = 128;
/// What covers falsely is trimmed at every so manieth look of a light. As views take turns, no divisor of their number.
const TRIM_EVERY: usize = 5;
/// The points of a lamp are chosen anew after so many looks: it, or what it lights, has gone on meanwhile.
const CHOSEN_FOR: usize = 24;
/// A set may grow to this many times the samples that it began with; then what no view saw for the longest goes.
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
    /// What its viewer sees by.
    pub viewer: Viewpoint,
    /// Which shadows it draws.
    pub shadows: Shadows,
    /// Images have as many pixels as a square of this side.
    pub side_px: u32,
    /// So many sets may begin.
    pub most_begun: usize,
    /// What the client holds.
    pub account: &'a mut Account,
    /// Sees the scene.
    pub imager: &'a mut dyn Imager,
}

/// Sends a client what the lights see that it draws shadows of, or what of that changed.
pub fn serve(mut serving: Serving<'_>, kept: &mut Kept) -> Result<(), StageError> {
    let lighting = serving.now.lighting;
    let wanted = kept.wanted(lighting, serving.viewer.eye_world);
    for other in kept.drop_others(&wanted) {
        serving.account.remove_where(|purpose| purpose == Purpose::Light(other))?;
    }
    let moved = kept.is_moved(serving.scene, serving.snapshot);
    let all = match &kept.scene {
        Some((_, all)) if !moved => *all,
        _ => whereabouts::bounds(serving.scene, serving.snapshot),
    };
    kept.scene = Some((serving.snapshot.clone(), all));
    serving.imager.blend(Blended::CutOut);
    serving.imager.smooth(true);
    let served = wanted.into_iter().try_for_each(|light| {
        let caster = Caster::of(&lighting.lights[usize::from(light)], serving.shadows);
        serving.serve(light, (caster, all), moved, kept)
    });
    serving.imager.smooth(false);
    served?;
    if let Some(news) = kept.news() {
        tracing::info!("lights: {news}");
    }
    Ok(())
}

impl Serving<'_> {
    fn serve(
        &mut self,
        light: u16,
        (caster, all): (Caster<'_>, Bounds),
        moved: bool,
        kept: &mut Kept,
    ) -> Result<(), StageError> {
        // What reliefs show to the eye casts like everything else. Bodies cast as they are, but for soft shadows, which are cast by samples.
        self.imager.leave_out(if caster.is_lamp() { LeftOut::default() } else { self.account.bodies_left_out() });
        let Some(known) = kept.lights.get_mut(&light) else {
            let Some(left) = self.most_begun.checked_sub(1) else { return Ok(()) };
            self.most_begun = left;
            kept.lights.insert(light, self.begin(light, (caster, all), false)?);
            return Ok(());
        };
        if let Some(set) = known.set.as_mut().filter(|set| set.looks >= set.looks_at_choice + CHOSEN_FOR) {
            (known.places, set.looks_at_choice) = (self.places(caster, all)?, set.looks);
        }
        let views = caster.views(all, self.viewer, &known.places, self.side_px);
        let before = std::mem::replace(&mut known.views, views);
        let views = &known.views;
        match &mut known.set {
            Some(set) => {
                if moved {
                    set.all_due(views.turns());
                } else {
                    set.also_due(views.new_turns(&before));
                }
                if set.due.is_empty() {
                    self.account.counts_mut().lights.unchanged += 1;
                } else {
                    self.follow(light, (views, all), set)?;
                }
            }
            None if moved || *views != before => *known = self.begin(light, (caster, all), true)?,
            None => self.account.counts_mut().lights.without += 1,
        }
        Ok(())
    }

    /// A first set, if the light casts anything; `is_known` to cast nothing so far.
    fn begin(
        &mut self,
        light: u16,
        (caster, all): (Caster<'_>, Bounds),
        is_known: bool,
    ) -> Result<KeptLight, StageError> {
        let purpose = Purpose::Light(light);
        let corners = Places::default();
        if !self.casts(&caster.views(all, self.viewer, &corners, PROBE_PX))? {
            self.account.counts_mut().lights.without += 1;
            if !is_known {
                self.account.add_nothing(light, self.now)?;
            }
            let views = caster.views(all, self.viewer, &corners, self.side_px);
            return Ok(KeptLight { places: corners, views, set: None });
        }
        let places = self.places(caster, all)?;
        let views = caster.views(all, self.viewer, &places, self.side_px);
        self.account.remove_where(|other| other == purpose)?;
        let imager = &*self.imager;
        self.account.draw_with(purpose, || imager.new_surfaces());
        for row in &views.0 {
            for mut capture in self.imager.captures(self.snapshot, row, METHOD)? {
                self.account.counts_mut().look_at(purpose, &capture);
                self.account.counts_mut().lights.views += 1;
                let lacking = Lacking::all(&capture);
                self.imager.tell_ends(&mut capture, &lacking.send)?;
                self.account.add(purpose, &capture, &lacking, precision(&capture.camera, all), self.now)?;
            }
        }
        self.account.counts_mut().lights.sets += 1;
        let set = Some(Set { samples: self.account.samples_for(purpose), ..Set::default() });
        Ok(KeptLight { places, views, set })
    }

    /// The points that a lamp is looked from.
    fn places(&mut self, caster: Caster<'_>, all: Bounds) -> Result<Places, StageError> {
        let faces = caster.all_views(all, places::PROBE_PX);
        let mut probes = Vec::with_capacity(faces.len());
        for face in &faces {
            self.account.counts_mut().lights.views += face.len();
            probes.push(self.imager.captures(self.snapshot, face, Discretization::Conventional)?);
        }
        Ok(Places::by_probes(&probes, places::BUDGET))
    }

    /// Brings a set up to date as a turn that is due sees it, or all of them where something deforms.
    fn follow(&mut self, light: u16, (views, all): (&Views, Bounds), set: &mut Set) -> Result<(), StageError> {
        let purpose = Purpose::Light(light);
        let deforms = self.scene.instances.iter().any(|instance| instance.deforms);
        self.account.delete_moved(purpose, self.now)?;
        while let Some(turn) = set.due.pop_front() {
            self.look_from(purpose, &views.at(turn), set.looks, all)?;
            set.looks += 1;
            if !deforms {
                break;
            }
        }
        Ok(self.account.evict_of(purpose, GROWS_TO * set.samples)?)
    }

    fn look_from(&mut self, purpose: Purpose, views: &[Pinhole], looks: usize, all: Bounds) -> Result<(), StageError> {
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
                precision: precision(&capture.camera, all),
            };
            // The scene, and the copy.
            self.account.counts_mut().lights.views += 2;
            revise(&mut *self.imager, self.account, capture, &revision, self.now)?;
        }
        Ok(())
    }

    /// Whether a view sees anything behind anything else.
    fn casts(&mut self, probes: &Views) -> Result<bool, StageError> {
        for view in probes.0.iter().flatten() {
            let layers = self.imager.captures(self.snapshot, &[*view; 2], Discretization::DepthPeeling)?;
            self.account.counts_mut().lights.views += layers.len();
            if layers.get(1).is_some_and(|second| second.ids.iter().any(|ids| ids[0] != 0)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// See [the module](super): what an eye that moves as far as the farthest corner is away sees shift by a tenth of a pixel.
fn precision(view: &Pinhole, all: Bounds) -> DepthPrecision {
    let eye_world = view.world_from_eye.translation;
    let offset_m = all.corners().iter().map(|corner| corner.distance(eye_world)).fold(0.0, f64::max);
    DepthPrecision::Parallax { epsilon_px: PARALLAX_ERROR_PX, focal_px: view.focal_px, offset_m }
}
