//! Looks that were taken for one client, and do for others.
//!
//! A look at what a client lacks takes more than views of the scene: the copy is drawn and compared, edits are made. All that depends on what looks did for the
//! client before ([`Past`]), on where its viewer stands, and on what it asks for. So a client that comes to where another one began is done for as that one was: the same
//! edits, at its own times, under its own digest. Once its viewer moves its past is its own.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use protocol::{Edit, PatchId};
use scene::Snapshot;

use super::{Client, LightWork, Made, Stage, StageError};
use crate::account::{Past, Surroundings};
use crate::imager::Occasion;
use crate::look_times::{Part, timed};
use crate::plan::{Coverage, Plan};
use crate::pool::{Answer, LookRequest, Looked, Pool, Request, Settings, SharingImager, Subject};
use crate::viewer::Viewer;

impl Stage {
    /// The same, which does nothing for viewers of a scene that never changes that is kept in a pool.
    pub fn sharing(self, pool: Arc<Pool>) -> Stage {
        let Some(still) = self.still.clone() else { return self };
        let imager = Box::new(SharingImager::new(self.imager, pool.clone(), still));
        Stage { imager, pool: Some(pool), ..self }
    }

    /// Whether a plan is of a viewer who stands, so that others may stand there.
    pub(super) fn stands(plan: &Plan, viewer: &Viewer) -> bool {
        !plan.reason.is_passing() && viewer.motion.is_still()
    }

    /// Looks at what a client lacks, or does what was done when that was looked at for another client.
    pub(super) fn look_once(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        let Some((pool, request)) = self.request(plan, client, viewer) else {
            return self.look(plan, snapshot, now, client, viewer);
        };
        let mut own = None;
        let answer = pool.answer(request, Occasion::Standing, || {
            let rows = client.rest.patches().to_vec();
            client.account.leave_ids_for_rest();
            let made = self.look(plan, snapshot, now, client, viewer)?;
            let past = pool.new_past();
            client.account.name_past(past);
            tracing::debug!(reason = plan.reason.name(), past = ?past, "looked for all who come");
            own = Some(made.clone());
            let made = made.map(|made| without_rows(made, &rows));
            Ok::<_, StageError>(Answer::Look(Box::new(Looked { past, served: client.served(), made })))
        })?;
        match (own, &*answer) {
            (Some(made), _) => Ok(made),
            (None, Answer::Look(looked)) => timed(Part::Keep, || self.repeat((plan, looked), now, client, viewer)),
            (None, _) => unreachable!("equal requests have answers of one kind"),
        }
    }

    /// Whether a client's look was taken for another one, or is being taken.
    pub(super) fn is_done(&self, plan: &Plan, client: &Client, viewer: &Viewer) -> bool {
        self.request(plan, client, viewer).is_some_and(|(pool, request)| pool.holds(&request))
    }

    /// What a look depends on, where others may want the same one.
    fn request(&self, plan: &Plan, client: &Client, viewer: &Viewer) -> Option<(Arc<Pool>, Request)> {
        let past = client.account.past();
        let pool = self.pool.clone().filter(|_| Stage::stands(plan, viewer) && past != Past::Own)?;
        let look = LookRequest {
            past,
            // A still scene is the same at any time.
            plan: Plan { coverage: Coverage { scene_time_s: 0.0, ..plan.coverage }, ..plan.clone() },
            view: viewer.view,
            draws: client.draws,
            budget_bytes: client.budget_bytes,
            portions: client.portions.clone(),
            begins_coarsely: client.begins_coarsely,
            judged_shapes: self.judged_shapes.load(Ordering::Relaxed),
        };
        let settings = Settings { excerpt: client.excerpt.clone(), ..Settings::default() };
        Some((pool, Request { settings, subject: Subject::Look(Box::new(look)) }))
    }

    /// Does what a look did for another client.
    fn repeat(
        &self,
        (plan, looked): (&Plan, &Looked),
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        client.account.begin_draft();
        self.drop_rest(client, viewer)?;
        let account = &mut client.account;
        let dropped = account.edits();
        let edits = looked.made.as_ref().map_or(&[][..], |made| &made.update.edits);
        account.repeat(edits, &looked.served.known, now, || self.imager.new_surfaces())?;
        account.name_past(looked.past);
        client.serve_as(&looked.served);
        let update = client.account.seal(now.time_s, viewer.pose_seq, self.rules.animated)?;
        let coding = self.coding.coding(viewer.bytes_per_s);
        let Some(update) = update else { return Ok(None) };
        let made = looked.made.as_ref();
        let of_lights = made.map_or(0..0, |made| made.lights.edits.start + dropped..made.lights.edits.end + dropped);
        Ok(Some(Made {
            reason: plan.reason,
            update,
            coding,
            counts: made.map(|made| made.counts).unwrap_or_default(),
            pixels: plan.pixels(),
            lights: LightWork { edits: of_lights, ..LightWork::default() },
            coded: made.map(|made| made.coded.clone()).unwrap_or_default(),
        }))
    }
}

/// What a look made, but for rows at rest that it took back: those are each client's own.
fn without_rows(mut made: Made, rows: &[PatchId]) -> Made {
    let before = made.update.edits.len();
    made.update.edits.retain(|edit| !matches!(edit, Edit::Remove(id) if rows.contains(id)));
    let dropped = before - made.update.edits.len();
    let edits = &mut made.lights.edits;
    *edits = edits.start.saturating_sub(dropped)..edits.end.saturating_sub(dropped);
    made
}
