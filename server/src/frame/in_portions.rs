//! A look at what a viewer who stands lacks, by a path that carries little: see [`crate::portions`].

use std::sync::Arc;

use protocol::Purpose;
use scene::Snapshot;

use super::views::revision;
use super::{Client, Plan, Stage, StageError};
use crate::account::Surroundings;
use crate::made::Came;
use crate::portions::{Portion, rows_of};
use crate::viewer::Viewer;

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

    /// Brings rows of a view of the plan up to date; how many samples that changed.
    fn look_at_rows(
        &mut self,
        plan: &Plan,
        (view, first, rows): (usize, u32, u32),
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
    ) -> Result<usize, StageError> {
        if !self.may_lack(plan, snapshot, &client.account) {
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
