use protocol::{Instance, ObjectPose, PatchId};
use scene::{Scene, Snapshot};

use super::{Eye, KeptReliefs, Key, Relief, Reliefs, Wanted};
use crate::account::{Account, Surroundings};
use crate::frame::StageError;
use crate::imager::Imager;

/// Sends a client the reliefs that it should be shown objects by, places and withdraws objects. Without an eye it is shown nothing so.
pub fn serve(
    reliefs: &mut Reliefs,
    at: (&Scene, &Snapshot),
    eye: Option<Eye>,
    now: &Surroundings<'_>,
    (account, kept): (&mut Account, &mut KeptReliefs),
    imager: &mut dyn Imager,
) -> Result<(), StageError> {
    let shown = kept.shown(account.held());
    let wanted = match eye {
        Some(eye) => reliefs.wanted(at, eye, &shown, imager)?,
        None => Default::default(),
    };
    let is_wanted = |object: &u16| wanted.values().any(|of_key| of_key.objects.binary_search(object).is_ok());
    let held = account.held().instances.keys().copied();
    account.withdraw(held.filter(|object| !is_wanted(object)).collect())?;
    let mut coarser = Vec::new();
    for (key, wanted) in &wanted {
        let Some(relief) = reliefs.image(*key, wanted.side_px, at, imager)? else { continue };
        coarser.extend(show(*key, wanted, relief, at, now, (&mut *account, &mut *kept))?);
    }
    for patch in coarser {
        let shown = account.held().instances.iter().filter(|(_, shown)| shown.relief == patch);
        account.withdraw(shown.map(|(&object, _)| object).collect())?;
        account.remove_impostor(patch)?;
    }
    Ok(())
}

/// Sends an image where a client lacks it, and shows objects by it that are not; the coarser image whose place it takes, if any.
fn show(
    key: Key,
    wanted: &Wanted,
    relief: &Relief,
    (scene, snapshot): (&Scene, &Snapshot),
    now: &Surroundings<'_>,
    (account, kept): (&mut Account, &mut KeptReliefs),
) -> Result<Option<PatchId>, StageError> {
    let mut coarser = None;
    let patch = match kept.patch(key, wanted.side_px, account.held()) {
        Some(patch) => patch,
        None => {
            let patch = account.add_relief(relief.image.clone(), relief.pose, now)?;
            coarser = kept.replace(key, wanted.side_px, patch);
            patch
        }
    };
    let is_new = |object: &u16| account.held().instances.get(object).is_none_or(|shown| shown.relief != patch);
    let instance = |object: u16| Instance {
        pose: ObjectPose { object, world_from_object: snapshot.world_from_mesh[usize::from(object)] },
        tint: scene.instances[usize::from(object)].tint,
    };
    let instances: Vec<Instance> = wanted.objects.iter().copied().filter(is_new).map(instance).collect();
    if !instances.is_empty() {
        account.place(patch, instances)?;
    }
    Ok(coarser.filter(|old| account.held().patches.contains_key(old)))
}
