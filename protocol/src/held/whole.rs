//! A copy as one update, for who comes late to it: the followers of a presenter.

use std::collections::{BTreeMap, BTreeSet};

use super::digest::Digest;
use super::{Edit, Held, Instance, NextSteps, ObjectPose, Patch, PatchId, Purpose, Update};
use crate::image::DepthImage;

impl Held {
    /// The copy as an update that begins anew. Who applies it, whatever he held before, holds the same: the next update follows, its digest comes
    /// out right, and so does everything that it may name. Its number is that of the last update, so it only helps those who hold less.
    pub fn whole(&self) -> Update {
        let mut edits = vec![Edit::Clear, Edit::Materials(self.materials.clone())];
        edits.extend(self.lighting.iter().map(|lighting| Edit::Light(Box::new(lighting.clone()))));
        edits.extend(self.sky.iter().cloned().map(Edit::Sky));
        let pose = |(&object, &world_from_object)| ObjectPose { object, world_from_object };
        if !self.poses_now.is_empty() {
            edits.push(Edit::Move(self.poses_now.iter().map(pose).collect()));
        }
        let by_relief = self.by_relief();
        let forgotten: BTreeSet<PatchId> =
            by_relief.keys().filter(|id| !self.patches.contains_key(id)).copied().collect();
        let ids: BTreeSet<PatchId> = self.patches.keys().copied().chain(forgotten.iter().copied()).collect();
        for id in ids {
            self.add_to(id, &mut edits);
        }
        edits.extend(by_relief.into_iter().map(|(relief, instances)| Edit::Place(relief, instances)));
        edits.extend(forgotten.into_iter().map(Edit::Remove));
        let mut digest = Digest(self.digest());
        digest.take_back(self.number);
        let came_to = edits.iter().fold(Digest(0), |mut digest, edit| {
            digest.edit(edit);
            digest
        });
        edits.push(Edit::Join(digest.0 ^ came_to.0));
        Update {
            number: self.number,
            scene_time_s: self.scene_time_s,
            pose_seq: 0,
            edits,
            next: NextSteps::default(),
            digest: self.digest(),
        }
    }

    /// A patch with its trims; of a relief that was forgotten while objects still name it, one without samples.
    fn add_to(&self, id: PatchId, edits: &mut Vec<Edit>) {
        let Some(held) = self.patches.get(&id) else {
            let (purpose, capture_time_s, objects) = (Purpose::Relief(0), self.scene_time_s, Vec::new());
            let image = DepthImage::without_samples();
            return edits.push(Edit::Add(Box::new(Patch { id, purpose, capture_time_s, objects, image })));
        };
        edits.push(Edit::Add(Box::new(held.patch.clone())));
        edits.extend(self.bodies.get(&id).map(|body| Edit::Body(id, body.clone())));
        let trimmed = held.patch.image.mask.occupied().zip(&held.trims).filter(|(_, extent)| **extent > 0);
        let trims: Vec<(u16, u16, u8)> = trimmed.map(|((x, y), extent)| (x as u16, y as u16, *extent)).collect();
        if !trims.is_empty() {
            edits.push(Edit::Trim(id, trims));
        }
    }

    fn by_relief(&self) -> BTreeMap<PatchId, Vec<Instance>> {
        let mut by_relief: BTreeMap<PatchId, Vec<Instance>> = BTreeMap::new();
        for (&(object, relief), held) in &self.instances {
            let pose = ObjectPose { object, world_from_object: held.world_from_object };
            by_relief.entry(relief).or_default().push(Instance { pose, tint: held.tint });
        }
        by_relief
    }
}
