//! Looks at what a viewer lacks, by a path that carries little: of who stands see [`crate::portions`]; of who moves view by view, and within views band by band.

use std::sync::Arc;

use protocol::Purpose;
use scene::Snapshot;

use super::views::revision;
use super::{Client, Plan, Stage, StageError};
use crate::account::Surroundings;
use crate::made::Came;
use crate::portions::{BYTES_PER_SAMPLE, Band, Portion, bands, rows_of};
use crate::viewer::Viewer;

/// What an update of a viewer who moves brings at most, of what one may bring: what the path carries in a fifth of a second. He is elsewhere soon.
const PASSING_SHARE: f64 = 0.4;
/// Portions in a turn at most, while none of them finds anything: other sessions may be waiting by then.
const MOST_PORTIONS: usize = 4;

impl Stage {
    /// Looks until something is found, or a round ends that found nothing.
    pub(super) fn look_in_portions(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Came, StageError> {
        let mut came = Came::default();
        for _ in 0..MOST_PORTIONS {
            let Some(portion) = client.portions.next(&plan.views, plan.allowance) else {
                came.has_ended = client.portions.end_round();
                break;
            };
            let found = match portion {
                Portion::Rows { view, first, rows } => {
                    self.look_at_rows(plan, (view, first, rows), snapshot, now, client)?
                }
                Portion::Beside => {
                    let before = client.account.edits();
                    came.lights = self.send_beside(plan, snapshot, now, client, viewer, 1)?;
                    client.account.edits() - before
                }
            };
            client.portions.looked(portion, found);
            if found > 0 {
                break;
            }
        }
        Ok(came)
    }

    /// Looks for a viewer who moves, view by view, the one first from where he is expected, until what is found is as much as his path carries soon. The next
    /// look finds the rest: of the first view it begins where this one ended. Whether it came to the last view.
    pub(super) fn look_in_passing(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
    ) -> Result<bool, StageError> {
        let most = (PASSING_SHARE * plan.allowance.bytes() / BYTES_PER_SAMPLE) as usize;
        let before = client.account.counts().added;
        for (view, camera) in plan.views.iter().enumerate() {
            let begin = if view == 0 { client.passing_begin } else { 0.0 };
            for Band { first, rows, end } in bands(camera, most, begin) {
                if client.account.counts().added - before >= most {
                    return Ok(false);
                }
                self.look_at_rows(plan, (view, first, rows), snapshot, now, client)?;
                if view == 0 {
                    client.passing_begin = end;
                }
            }
        }
        Ok(true)
    }

    /// Brings rows of a view of the plan up to date; how many samples that changed.
    fn look_at_rows(
        &mut self,
        plan: &Plan,
        (view, first, rows): (usize, u32, u32),
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
    ) -> Result<usize, StageError> {
        if !self.may_lack(plan, snapshot, client) {
            return Ok(0);
        }
        let changed = |client: &Client| {
            let counts = client.account.counts();
            counts.added + counts.deleted + counts.trimmed
        };
        let (before, account) = (changed(client), &mut client.account);
        let (account_rules, looks) = (self.account_rules, account.looks());
        let camera = rows_of(&plan.views[view], first, rows);
        self.look_beside(&[camera], snapshot, now, account, |_, pixels| {
            revision(&account_rules, looks, plan, Purpose::Eye, (view, pixels))
        })?;
        Ok(changed(client) - before)
    }
}
