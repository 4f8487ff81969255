//! The tick of a session whose viewer lacks nothing: what it will need next, see [`crate::anticipate`].

use std::sync::Arc;

use camera::Pinhole;
use protocol::Purpose;
use scene::Snapshot;

use super::{Client, LightWork, Made, Put, Stage, StageError};
use crate::account::{Account, AccountRules, Surroundings};
use crate::anticipate::{self, Around, Part};
use crate::discretize::Discretization;
use crate::imager::Occasion;
use crate::plan::{Reason, Rules, own_view, precision_within};
use crate::render::Blended;
use crate::revise::{Revision, revise};
use crate::viewer::Viewer;

/// Views that are looked at ahead in a turn at most, while none of them shows anything new: other sessions may be waiting by then.
const LOOKS_AHEAD: usize = 4;

impl Stage {
    /// Makes what a client that lacks nothing will need next, or nothing where that is held too. To be asked when nobody needs anything.
    pub fn anticipate(&mut self, viewer: &Viewer, client: &mut Client, now_s: f64) -> Result<Option<Made>, StageError> {
        let Some(focus) = client.focus.filter(|_| anticipate::may(&self.rules, client, viewer, now_s)) else {
            return Ok(None);
        };
        client.looked_at_s = now_s;
        self.imager.show(&client.excerpt);
        let rules = Rules { image_size_px: self.image_size_px(client), ..self.rules };
        let own = own_view(&focus.coverage, &rules);
        self.with_surroundings(now_s, Put::before(client), |stage, snapshot, now| {
            stage.look_ahead(&own, snapshot, now, client, viewer)
        })
    }

    /// Looks for what a viewer who lacks nothing will see next, until something is found.
    fn look_ahead(
        &mut self,
        own: &Pinhole,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        client.account.draw_with(Purpose::Eye, || self.imager.new_surfaces());
        client.account.begin(now)?;
        self.imager.draw_for(Occasion::Ahead);
        self.imager.leave_out(client.account.left_out());
        self.imager.blend(Blended::LeftOut);
        let around = self.around(viewer, own, snapshot)?;
        let revision = Revision {
            purpose: Purpose::Eye,
            rules: AccountRules { outlines_stand_in: true, ..self.account_rules },
            peers: &[],
            trims: true,
            supersedes: false,
            looks_again: true,
            least_px: 0.0,
            is_seen: false,
            precision: precision_within(&self.rules, viewer.view, 0.0),
        };
        let denser = self.denser(snapshot, client, viewer);
        let view_from = |world_from_eye| denser(&Pinhole { world_from_eye, ..*own });
        let mut pixels = 0;
        for _ in 0..LOOKS_AHEAD {
            let Some(part) = anticipate::next(&self.rules, client, viewer, &around, view_from) else {
                client.ahead.ended(viewer);
                break;
            };
            self.look_ahead_from(&part, snapshot, now, &mut client.account, &revision)?;
            client.ahead.looked(&part);
            pixels += u64::from(part.camera.width_px) * u64::from(part.camera.height_px);
            if !client.account.counts().is_still() {
                break;
            }
        }
        let mut counts = client.account.counts();
        counts.ahead = counts.added;
        let update = client.account.seal(now.time_s, viewer.pose_seq, self.rules.animated)?;
        let coding = self.coding.coding(viewer.bytes_per_s);
        let lights = LightWork::default();
        Ok(update.map(|update| Made {
            reason: Reason::Ahead,
            update,
            coding,
            counts,
            pixels,
            lights,
            coded: Arc::default(),
        }))
    }

    /// Brings the copy up to date by a view ahead. Others are sent other rows of the same view, so all of it is drawn where that can be kept.
    fn look_ahead_from(
        &mut self,
        part: &Part,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        account: &mut Account,
        revision: &Revision<'_>,
    ) -> Result<(), StageError> {
        if self.pool.is_none() || self.imager.comparer().is_some() {
            return self.look_beside(&[part.camera], snapshot, now, account, |_, _| *revision);
        }
        for capture in self.imager.captures(snapshot, &[part.view], Discretization::Conventional)? {
            revise(&mut *self.imager, account, &mut part.rows_of(capture), revision, now)?;
        }
        Ok(())
    }

    /// What a viewer who stands still will turn about, or where he stands.
    fn around(&mut self, viewer: &Viewer, own: &Pinhole, snapshot: &Snapshot) -> Result<Around, StageError> {
        if let Some(object) = Around::object(viewer, self.scene.bounds.centre(), self.scene.walk) {
            return Ok(object);
        }
        let (ahead, behind) = anticipate::ways(own);
        let probes = self.imager.captures(snapshot, &[ahead, behind], Discretization::Conventional)?;
        let free_m: Vec<f64> = probes.iter().map(anticipate::free_m).collect();
        Ok(Around::Place { free_m: [free_m[0], free_m[1]] })
    }
}
