//! One view of the scene beside the same view of what a client holds, and the edits that follow.

use camera::Pinhole;
use protocol::Purpose;
use surface::AddressView;

use crate::account::compare::Comparison;
use crate::account::findings::Lacking;
use crate::account::{Account, AccountRules, Surroundings};
use crate::beside::{Asked, Found, KeptView};
use crate::discretize::{Capture, DepthPrecision};
use crate::imager::Imager;
use crate::look_times::{Part, timed};
use crate::stage_error::StageError;

/// How a view is brought up to date.
#[derive(Debug, Clone, Copy)]
pub struct Revision<'a> {
    /// What is held for this is looked at.
    pub purpose: Purpose,
    /// What decides.
    pub rules: AccountRules,
    /// The views of the plan: what one of them sent is not replaced by another.
    pub peers: &'a [Pinhole],
    /// Whether what covers falsely is trimmed.
    pub trims: bool,
    /// Whether what finer samples have taken the place of is given up; of the eye's samples only.
    pub supersedes: bool,
    /// Whether the copy is looked at again once something was trimmed: what lacks behind it can wait where there will be another look.
    pub looks_again: bool,
    /// Whether the viewer sees it: what is sent for later counts as never seen, and goes first where there is no room.
    pub is_seen: bool,
    /// A view that lacks fewer pixels than this is sent nothing.
    pub least_px: f64,
    /// How finely depth is stored.
    pub precision: DepthPrecision,
}

/// Lays a capture beside the same view of the copy, and brings the copy up to date there.
pub fn revise(
    imager: &mut dyn Imager,
    account: &mut Account,
    capture: &mut Capture,
    revision: &Revision<'_>,
    now: &Surroundings<'_>,
) -> Result<(), StageError> {
    let (purpose, view) = (revision.purpose, capture.camera);
    account.counts_mut().look_at(purpose, capture);
    let mut copy = timed(Part::Copy, || copy_view(imager, account, revision.purpose, &view))?;
    let peers = account.captured_by(revision.peers);
    let judge = |account: &Account, copy: &AddressView, capture: &Capture| {
        let comparison = Comparison::new(capture, (purpose, copy), account, &peers, revision.rules);
        let false_cover = if revision.trims { comparison.false_cover() } else { Vec::new() };
        let mut lacking = comparison.lacking();
        if lacking.missing as f64 <= revision.least_px {
            lacking = Lacking::nothing(capture);
        }
        let superseded = revision.supersedes.then(|| account.superseded(&comparison, &lacking));
        (false_cover, lacking, superseded.unwrap_or_default())
    };
    let (false_cover, mut lacking, mut superseded) = timed(Part::Compare, || judge(account, &copy, capture));
    let retracted = timed(Part::Keep, || account.retract(purpose, &false_cover))?;
    if retracted && revision.looks_again {
        copy = timed(Part::Copy, || copy_view(imager, account, purpose, &view))?;
        (_, lacking, superseded) = timed(Part::Compare, || judge(account, &copy, capture));
    }
    if revision.is_seen {
        account.mark_seen(&copy);
    }
    timed(Part::Scene, || imager.tell_ends(capture, &lacking.send))?;
    timed(Part::Keep, || {
        account.add(purpose, capture, &lacking, revision.precision, now)?;
        if !revision.is_seen {
            account.mark_added_unseen();
        }
        Ok(account.supersede(&superseded)?)
    })
}

/// The same of a view that was left on the GPU: both are laid beside each other there.
pub fn revise_kept(
    imager: &mut dyn Imager,
    account: &mut Account,
    view: &KeptView,
    revision: &Revision<'_>,
    now: &Surroundings<'_>,
) -> Result<(), StageError> {
    let peers = account.captured_by(revision.peers);
    let asked = Asked {
        rules: revision.rules,
        peers: &peers,
        trims: revision.trims,
        supersedes: revision.supersedes,
        is_seen: revision.is_seen,
        least_px: revision.least_px,
    };
    let Some(mut found) = compare(imager, account, view, &asked)? else { return Ok(()) };
    account.counts_mut().look_at_hits(revision.purpose, found.hits);
    let retracted = timed(Part::Keep, || account.retract(revision.purpose, &found.false_cover))?;
    if retracted && revision.looks_again {
        let Some(again) = compare(imager, account, view, &asked)? else { return Ok(()) };
        found = again;
    }
    let Found { capture, lacking, superseded, .. } = found;
    timed(Part::Keep, || {
        account.add(revision.purpose, &capture, &lacking, revision.precision, now)?;
        if !revision.is_seen {
            account.mark_added_unseen();
        }
        Ok(account.supersede(&superseded)?)
    })
}

fn compare(
    imager: &mut dyn Imager,
    account: &mut Account,
    view: &KeptView,
    asked: &Asked<'_>,
) -> Result<Option<Found>, StageError> {
    timed(Part::Copy, || account.refresh());
    let Some(comparer) = imager.comparer() else { return Ok(None) };
    Ok(comparer.compare(account, view, asked)?)
}

/// A view of the copy as it is now.
fn copy_view(
    imager: &mut dyn Imager,
    account: &mut Account,
    purpose: Purpose,
    view: &Pinhole,
) -> Result<AddressView, StageError> {
    account.refresh();
    Ok(imager.copy_view(account, purpose, view)?)
}
