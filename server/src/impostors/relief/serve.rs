use std::collections::{BTreeMap, BTreeSet};

use protocol::{Instance, ObjectPose, PatchId};
use scene::{Scene, Snapshot};

use super::{Eye, KeptReliefs, Otherwise, Reliefs, Wanted};
use crate::account::{Account, Surroundings};
use crate::imager::Imager;
use crate::stage_error::StageError;

/// Sends a client the reliefs that it should be shown objects by, places and withdraws objects. Without an eye it is shown nothing so.
pub fn serve(
    reliefs: &mut Reliefs,
    at: (&Scene, &Snapshot),
    (eye, otherwise): (Option<Eye>, Otherwise<'_>),
    now: &Surroundings<'_>,
    (account, kept): (&mut Account, &mut KeptReliefs),
    imager: &mut dyn Imager,
) -> Result<(), StageError> {
    let wanted = match eye {
        Some(eye) => reliefs.wanted(at, eye, (&kept.shown(account.held()), otherwise), imager)?,
        None => BTreeMap::new(),
    };
    let mut shown_by: BTreeMap<PatchId, Wanted> = BTreeMap::new();
    let mut coarser = Vec::new();
    for (key, wanted) in wanted {
        let held = kept.patch(key, wanted.side_px, account.held());
        let patch = match held {
            Some(patch) => patch,
            None => {
                let Some(relief) = reliefs.image(key, wanted.side_px, at, imager)? else { continue };
                let patch = account.add_relief(relief.image.clone(), relief.pose, now)?;
                coarser.extend(kept.replace(key, wanted.side_px, patch));
                patch
            }
        };
        shown_by.insert(patch, wanted);
    }
    let lacking = withdraw_others(&shown_by, account)?;
    let instances = |objects: Vec<u16>| objects.into_iter().map(|object| instance(at, object)).collect();
    account.place(lacking.into_iter().map(|(patch, objects)| (patch, instances(objects))).collect())?;
    coarser.into_iter().try_for_each(|patch| account.remove_whole(patch))?;
    Ok(())
}

/// Withdraws the objects that are shown by any other relief than they should be; what is then still to be placed, by relief.
fn withdraw_others(
    shown_by: &BTreeMap<PatchId, Wanted>,
    account: &mut Account,
) -> Result<BTreeMap<PatchId, Vec<u16>>, StageError> {
    let is_wanted = |&(object, relief): &(u16, PatchId)| {
        shown_by.get(&relief).is_some_and(|wanted| wanted.objects.binary_search(&object).is_ok())
    };
    let is_by_relief = |(_, id): &&(u16, PatchId)| !account.held().bodies.contains_key(id);
    let held: BTreeSet<(u16, PatchId)> = account.held().instances.keys().filter(is_by_relief).copied().collect();
    let withdrawn: BTreeSet<u16> = held.iter().filter(|key| !is_wanted(key)).map(|(object, _)| *object).collect();
    let is_there = |object: u16, relief: PatchId| held.contains(&(object, relief)) && !withdrawn.contains(&object);
    let mut lacking = BTreeMap::new();
    for (&patch, wanted) in shown_by {
        let objects: Vec<u16> = wanted.objects.iter().copied().filter(|&object| !is_there(object, patch)).collect();
        if !objects.is_empty() {
            lacking.insert(patch, objects);
        }
    }
    account.withdraw(withdrawn.into_iter().collect())?;
    Ok(lacking)
}

fn instance((scene, snapshot): (&Scene, &Snapshot), object: u16) -> Instance {
    let world_from_object = snapshot.world_from_mesh[usize::from(object)];
    Instance { pose: ObjectPose { object, world_from_object }, tint: scene.instances[usize::from(object)].tint }
}
