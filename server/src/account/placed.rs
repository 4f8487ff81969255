//! What a client is shown by reliefs and bodies, in place of samples.

use std::collections::BTreeSet;
use std::sync::Arc;

use protocol::{Body, DepthImage, Edit, HeldError, Instance, ObjectPose, PatchId, Purpose};

use super::{Account, Surroundings};
use crate::render::LeftOut;

impl Account {
    /// Adds a relief, taken of an object at a place; it shows nothing until objects are [placed](Account::place).
    pub fn add_relief(
        &mut self,
        image: DepthImage,
        pose: ObjectPose,
        now: &Surroundings<'_>,
    ) -> Result<PatchId, HeldError> {
        self.add_whole(image, Purpose::Relief(pose.object), vec![pose], now)
    }

    /// Adds a body; it shows nothing until objects are [placed](Account::place).
    pub fn add_body(
        &mut self,
        atlas: DepthImage,
        body: Arc<Body>,
        now: &Surroundings<'_>,
    ) -> Result<PatchId, HeldError> {
        let id = self.add_whole(atlas, Purpose::Body, Vec::new(), now)?;
        self.held.edit(Edit::Body(id, body), &mut self.draft)?;
        Ok(id)
    }

    /// The objects that the client moves by their bodies' clips, and of which it holds nothing else.
    pub fn moved_by_clips(&self) -> BTreeSet<u16> {
        let held = &self.held;
        let mut objects = self.shown_bent();
        if !objects.is_empty() {
            let named = held.patches.values().flat_map(|held| &held.patch.objects);
            named.for_each(|pose| {
                objects.remove(&pose.object);
            });
        }
        objects
    }

    /// The objects that reliefs and bodies show.
    pub fn shown_otherwise(&self) -> BTreeSet<u16> {
        self.held.instances.keys().map(|(object, _)| *object).collect()
    }

    /// The same, as views of the scene are drawn without them. What is rigid and shown as it is hides what lies behind it. A figure does not: a moment later
    /// it hides something else; nor does a relief, which rounds.
    pub fn left_out(&self) -> LeftOut {
        let is_rigid = |id: &PatchId| self.held.bodies.get(id).is_some_and(|body| body.skin.is_none());
        let (hiding, absent): (Vec<_>, Vec<_>) = self.held.instances.keys().partition(|(_, id)| is_rigid(id));
        let objects = |of: Vec<&(u16, PatchId)>| of.into_iter().map(|(object, _)| *object).collect();
        LeftOut { absent: objects(absent), hiding: objects(hiding) }
    }

    /// The same of bodies alone.
    pub fn bodies_left_out(&self) -> LeftOut {
        let bodies = self.shown_as_bodies();
        let all = self.left_out();
        LeftOut { absent: all.absent.intersection(&bodies).copied().collect(), ..all }
    }

    /// The objects that bodies show.
    pub fn shown_as_bodies(&self) -> BTreeSet<u16> {
        let held = &self.held;
        held.instances.keys().filter(|(_, id)| held.bodies.contains_key(id)).map(|(object, _)| *object).collect()
    }

    /// The objects that bodies show as they are bent.
    pub fn shown_bent(&self) -> BTreeSet<u16> {
        let held = &self.held;
        let is_bent = |id: &PatchId| held.bodies.get(id).is_some_and(|body| body.skin.is_some());
        held.instances.keys().filter(|(_, id)| is_bent(id)).map(|(object, _)| *object).collect()
    }

    /// Shows objects by reliefs or bodies from now on, and deletes their samples; ids ascend, of each.
    pub fn place(&mut self, placed: Vec<(PatchId, Vec<Instance>)>) -> Result<(), HeldError> {
        if placed.is_empty() {
            return Ok(());
        }
        let objects: BTreeSet<u16> =
            placed.iter().flat_map(|(_, of)| of).map(|instance| instance.pose.object).collect();
        let mut replaced = Vec::new();
        // What lights see of it stays.
        for (id, held) in self.held.patches.iter().filter(|(_, held)| held.patch.purpose == Purpose::Eye) {
            let samples = held.patch.image.mask.occupied().zip(&held.patch.image.object);
            let of_these = samples.filter(|(_, object)| objects.contains(object));
            replaced.extend(of_these.map(|((x, y), _)| (*id, x as u16, y as u16)));
        }
        self.counts.deleted += replaced.len();
        self.delete(&replaced)?;
        placed.into_iter().try_for_each(|(id, instances)| self.held.edit(Edit::Place(id, instances), &mut self.draft))
    }

    /// Shows objects by no relief and no body any more; they are sampled as everything else.
    pub fn withdraw(&mut self, objects: Vec<u16>) -> Result<(), HeldError> {
        if objects.is_empty() { Ok(()) } else { self.held.edit(Edit::Withdraw(objects), &mut self.draft) }
    }
}
