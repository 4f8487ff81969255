//! The views of a plan, laid beside the same views of the copy.

use std::sync::Arc;

use camera::Pinhole;
use glam::Vec3;
use protocol::Purpose;
use scene::Snapshot;

use super::{Account, AccountRules, Client, Plan, Stage, StageError, Surroundings, half_view, region_views};
use crate::discretize::placement::{self, Budget, Placement};
use crate::discretize::{Capture, Discretization};
use crate::look_times::{Part, timed};
use crate::plan::Rules;
use crate::render::{Frustum, world_bounds};
use crate::revise::{Revision, revise, revise_kept};

/// Places on the region's rim that probes are taken from.
const PLACES_ON_RIM: usize = 12;

impl Stage {
    /// Whether a look from a plan's views can change anything: samples are held for the eye, or an object lies in a view that is shown by samples.
    pub(super) fn may_lack(&self, plan: &Plan, snapshot: &Snapshot, client: &Client) -> bool {
        let account = &client.account;
        if account.holds_for(Purpose::Eye) {
            return true;
        }
        let (scene, otherwise) = (&self.scene, account.shown_otherwise());
        let frusta: Vec<Frustum> = plan.views.iter().map(Frustum::new).collect();
        let objects = scene.instances.iter().zip(&snapshot.world_from_mesh).zip(0_u16..);
        objects.into_iter().any(|((instance, world_from_mesh), object)| {
            let mesh = || scene.meshes.get(instance.mesh as usize).filter(|_| !instance.deforms);
            let is_outside = || {
                let bounds = mesh().map(|mesh| world_bounds(world_from_mesh, mesh.bounds.map(Vec3::from)));
                bounds.is_some_and(|bounds| !frusta.iter().any(|frustum| frustum.may_see(&bounds)))
            };
            client.excerpt.parts.shows(object) && !otherwise.contains(&object) && !is_outside()
        })
    }

    /// The views of a set by itself.
    pub(super) fn set_views(&mut self, plan: &Plan, snapshot: &Snapshot) -> Result<Vec<Pinhole>, StageError> {
        if self.placement == Placement::Fixed || plan.views.len() < 2 {
            return Ok(plan.views.clone());
        }
        let candidates = region_views(&plan.coverage, &Rules { images: 1 + PLACES_ON_RIM, ..self.rules });
        let probes: Vec<Pinhole> = candidates.iter().map(|view| placement::probe(view, placement::PROBE_PX)).collect();
        let probes = self.imager.captures(snapshot, &probes, Discretization::Conventional)?;
        let chosen = placement::place(&probes, half_view(plan.coverage.view), Budget::of(plan.views.len()));
        tracing::debug!(views = ?chosen.views, missing = ?chosen.missing, "placed by probes");
        Ok(chosen.views.into_iter().map(|view| candidates[view]).collect())
    }

    /// Brings what the eye's copy shows of a plan's views up to date.
    pub(super) fn look_from_all(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        account: &mut Account,
    ) -> Result<(), StageError> {
        let (account_rules, looks) = (self.account_rules, account.looks());
        self.look_beside(&plan.views, snapshot, now, account, |index, pixels| {
            revision(&account_rules, looks, plan, Purpose::Eye, (index, pixels))
        })
    }

    /// Brings what the eye's copy shows of views up to date, of each as `revision` says by its number and its pixels. All views of the scene are drawn at once: what
    /// they show does not depend on the copy, and each wait for the GPU has a cost of its own.
    pub(super) fn look_beside<'a>(
        &mut self,
        views: &[Pinhole],
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        account: &mut Account,
        revision: impl Fn(usize, usize) -> Revision<'a>,
    ) -> Result<(), StageError> {
        if let Some(comparer) = self.imager.comparer()
            && timed(Part::Copy, || comparer.takes(account, views))
        {
            let kept = timed(Part::Scene, || comparer.keep(snapshot, views))?;
            for (index, view) in kept.iter().enumerate() {
                let pixels = view.camera.width_px as usize * view.camera.height_px as usize;
                revise_kept(&mut *self.imager, account, view, &revision(index, pixels), now)?;
            }
            return Ok(());
        }
        let mut captures = timed(Part::Scene, || self.imager.captures(snapshot, views, Discretization::Conventional))?;
        for (index, capture) in captures.iter_mut().enumerate() {
            let pixels = capture.ids.len();
            revise(&mut *self.imager, account, capture, &revision(index, pixels), now)?;
        }
        Ok(())
    }

    /// Lays one view of a plan beside the same view of the copy, and brings the copy up to date there.
    pub(super) fn look_from(
        &mut self,
        index: usize,
        capture: &mut Capture,
        plan: &Plan,
        (purpose, now): (Purpose, &Surroundings<'_>),
        account: &mut Account,
    ) -> Result<(), StageError> {
        let revision = revision(&self.account_rules, account.looks(), plan, purpose, (index, capture.ids.len()));
        revise(&mut *self.imager, account, capture, &revision, now)
    }
}

/// How a view of a plan, by its number and its pixels, is brought up to date.
pub(super) fn revision<'a>(
    account_rules: &AccountRules,
    looks: usize,
    plan: &'a Plan,
    purpose: Purpose,
    (index, pixels): (usize, usize),
) -> Revision<'a> {
    let is_passing = plan.reason.is_passing();
    let rules = AccountRules { outlines_stand_in: is_passing, refines: index < plan.refining, ..*account_rules };
    let trims = !is_passing || looks.is_multiple_of(rules.trim_every);
    Revision {
        purpose,
        rules,
        peers: &plan.views,
        trims,
        // What a still viewer is sent comes to an end; nothing of it is given up for another view's sake.
        supersedes: purpose == Purpose::Eye && is_passing && rules.refines && trims,
        looks_again: !is_passing,
        is_seen: true,
        least_px: if index == 0 { 0.0 } else { rules.least_missing * pixels as f64 },
        precision: plan.precision,
    }
}
