//! Sends a client the bodies that it should hold.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;
use protocol::{Instance, ObjectPose, PatchId};
use scene::{Scene, Snapshot};

use super::decide::{Eye, wanted};
use super::store::Bodies;
use crate::account::{Account, Surroundings};
use crate::stage_error::StageError;

/// The bodies that a client was sent, by object.
#[derive(Debug, Clone, Default)]
pub struct KeptBodies(BTreeMap<u16, PatchId>);

/// Sends a client bodies of objects that it is better sent so.
pub fn serve(
    bodies: &Bodies,
    at: (&Scene, &Snapshot),
    codes: &[Option<u8>],
    eye: &Eye,
    now: &Surroundings<'_>,
    (account, kept): (&mut Account, &mut KeptBodies),
) -> Result<(), StageError> {
    kept.0.retain(|_, id| account.held().bodies.contains_key(id));
    let (scene, _) = at;
    let has = kept.0.clone();
    for object in wanted(bodies, at, codes, eye, |object| has.contains_key(&object)) {
        // Many of one shape are shown by one relief for all.
        if has.contains_key(&object) || account.shown_otherwise().contains(&object) {
            continue;
        }
        let Some(made) = bodies.made(object, scene, codes) else { continue };
        let id = account.add_body(made.atlas.clone(), made.body.clone(), now)?;
        kept.0.insert(object, id);
        let world_from_object = DAffine3::from_translation(made.origin_world);
        let tint = scene.instances[usize::from(object)].tint;
        account.place(id, vec![Instance { pose: ObjectPose { object, world_from_object }, tint }])?;
    }
    Ok(())
}

/// The objects that a client is shown as bodies.
pub fn shown_as_bodies(account: &Account) -> BTreeSet<u16> {
    let held = account.held();
    held.instances.keys().filter(|(_, id)| held.bodies.contains_key(id)).map(|(object, _)| *object).collect()
}
