//! Turns that were taken for one client, and do for others.
//!
//! A look at what a client lacks takes more than views of the scene: the copy is drawn and compared, edits are made. All that depends on what was done for the
//! client before ([`Past`]), on where its viewer stands, and on what it asks for. So a client that comes to where another one began is done for as that one was: the same
//! edits, at its own times, under its own digest. Once its viewer moves its past is its own.

use std::sync::Arc;

use scene::Snapshot;

use super::{Client, LightWork, Made, Stage, StageError, free, stands};
use crate::account::{Past, Surroundings};
use crate::imager::Occasion;
use crate::look_times::{Part, timed};
use crate::pool::{Images, LookRequest, Looked, Pool, Request, Settings, Subject, Work};
use crate::rest;
use crate::viewer::Viewer;

impl Stage {
    /// Takes a turn, or does what was done when it was taken for another client.
    pub(super) fn shared(
        &mut self,
        work: &Work,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        let Some((pool, request)) = self.request(work, now, client, viewer) else {
            return self.work(work, snapshot, now, client, viewer);
        };
        let mut own = None;
        let images = pool.images(request, Occasion::Standing, || {
            let made = self.work(work, snapshot, now, client, viewer)?;
            let past = pool.new_past();
            client.account.name_past(past);
            own = Some(made.clone());
            Ok::<_, StageError>(Images::Look(Box::new(Looked { past, served: client.served(), made })))
        })?;
        match (own, &*images) {
            (Some(made), _) => Ok(made),
            (None, Images::Look(looked)) => timed(Part::Keep, || self.repeat(looked, now, client, viewer)),
            (None, _) => unreachable!("equal requests have answers of one kind"),
        }
    }

    /// What a turn depends on, where others may take the same one.
    fn request(
        &self,
        work: &Work,
        now: &Surroundings<'_>,
        client: &Client,
        viewer: &Viewer,
    ) -> Option<(Arc<Pool>, Request)> {
        let is_common = match work {
            Work::Look(plan) => stands(plan, viewer),
            Work::Rest(_) => true,
        };
        let pool = self.pool.clone().filter(|_| is_common && client.account.past() != Past::Own)?;
        let look = LookRequest {
            past: client.account.past(),
            work: without_time(work),
            view: viewer.view,
            draws: client.draws,
            budget_bytes: client.budget_bytes,
            begins_coarsely: self.begins_coarsely(client),
            drops_rest: rest::is_outdated(&self.rules, client, viewer, now.time_s),
            // While another thread judges a shape, what is shown by reliefs is about to change.
            judged_shapes: free(&self.reliefs)?.judged_shapes(),
        };
        Some((pool, Request { settings: Settings::default(), subject: Subject::Look(Box::new(look)) }))
    }

    /// Does what a look did for another client.
    fn repeat(
        &self,
        looked: &Looked,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        let edits = looked.made.as_ref().map_or(&[][..], |made| &made.update.edits);
        client.account.repeat(edits, &looked.served.known, now, || self.imager.new_surfaces())?;
        client.serve_as(&looked.served);
        client.account.name_past(looked.past);
        let update = client.account.seal(now.time_s, viewer.pose_seq, self.rules.animated)?;
        let coding = self.coding.coding(viewer.bytes_per_s);
        Ok(update.zip(looked.made.as_ref()).map(|(update, made)| {
            let &Made { reason, counts, pixels, .. } = made;
            let lights = LightWork { edits: made.lights.edits.clone(), ..LightWork::default() };
            Made { reason, update, coding, counts, pixels, lights }
        }))
    }
}

/// The same at any time: a still scene does not change.
fn without_time(work: &Work) -> Work {
    let mut work = work.clone();
    if let Work::Look(plan) = &mut work {
        plan.coverage.scene_time_s = 0.0;
    }
    work
}
