//! Applying an update: checked edit by edit on the side, then taken over as a whole.

use std::collections::BTreeMap;
use std::sync::Arc;

use camera::Camera;
use glam::DAffine3;

use super::digest::{Digest, EMPTY};
use super::{
    Draft, Edit, Held, HeldError, HeldInstance, HeldPatch, Instance, NextSteps, ObjectPose, ObjectShift, Patch,
    PatchId, Purpose, Update,
};
use crate::body::Body;
use crate::image::{DepthImage, Mask, Ranks, retain};
use crate::limits::Limits;
use crate::sky::Sky;
use crate::wire::graph::is_graph_encodable;

/// What an update changes, before it counts.
struct Staged<'a> {
    base: &'a Held,
    limits: &'a Limits,
    /// Whether everything of `base` is forgotten.
    cleared: bool,
    /// Patches that differ from `base`; `None` where one was removed.
    patches: BTreeMap<PatchId, Option<HeldPatch>>,
    poses: BTreeMap<u16, DAffine3>,
    /// Bodies that are new.
    bodies: BTreeMap<PatchId, Arc<Body>>,
    /// Instances that differ from `base`; `None` where one was withdrawn.
    instances: BTreeMap<(u16, PatchId), Option<HeldInstance>>,
    materials: Option<Vec<crate::look::Material>>,
    lighting: Option<crate::look::Lighting>,
    sky: Option<Arc<Sky>>,
    last_patch: Option<PatchId>,
    count: usize,
    samples: usize,
    pixels: usize,
    digest: Digest,
}

impl Held {
    /// Applies an update with the default [`Limits`]; see [`Held::apply_within`].
    pub fn apply(&mut self, update: &Update) -> Result<(), HeldError> {
        self.apply_within(update, &Limits::default())
    }

    /// Applies an update as a whole, or changes nothing: its number must follow unless it clears, ids must be new, addresses must name held
    /// samples, planes must fit their masks, everything must be finite and within `limits`, and the digest must come out as
    /// the update says.
    pub fn apply_within(&mut self, update: &Update, limits: &Limits) -> Result<(), HeldError> {
        let clears = matches!(update.edits.first(), Some(Edit::Clear));
        // An update that clears may have said any number, the last one too.
        if !clears && self.number.checked_add(1) != Some(update.number) {
            return Err(HeldError::Number { held: self.number, update: update.number });
        }
        if !update.scene_time_s.is_finite() {
            return Err(HeldError::NotFinite("scene time"));
        }
        check_next(&update.next)?;
        let changes = self.stage(&update.edits, limits)?;
        let digest = sealed(changes.digest, update.number);
        if digest != update.digest {
            return Err(HeldError::Digest { number: update.number });
        }
        self.take_over(changes);
        self.finish(update.number, update.scene_time_s, digest);
        Ok(())
    }

    /// Makes the next update from edits and applies it: the server's side of [`Held::apply`], which fills in number and digest.
    pub fn commit(&mut self, edits: Vec<Edit>, scene_time_s: f64, pose_seq: u64) -> Result<Update, HeldError> {
        let changes = self.stage(&edits, &Limits::default())?;
        self.take_over(changes);
        self.seal(Draft { edits }, scene_time_s, pose_seq)
    }

    /// Applies one edit of an update in the making at once, so that the next one can be chosen by what is held then. The
    /// update is complete after [`Held::seal`]; a refused edit changes nothing.
    pub fn edit(&mut self, edit: Edit, draft: &mut Draft) -> Result<(), HeldError> {
        if matches!(edit, Edit::Clear) && !draft.edits.is_empty() {
            return Err(HeldError::LateClear);
        }
        let changes = self.stage(std::slice::from_ref(&edit), &Limits::default())?;
        self.take_over(changes);
        draft.edits.push(edit);
        Ok(())
    }

    /// Numbers the update whose edits are in `draft`, and gives it its digest.
    pub fn seal(&mut self, draft: Draft, scene_time_s: f64, pose_seq: u64) -> Result<Update, HeldError> {
        if !scene_time_s.is_finite() {
            return Err(HeldError::NotFinite("scene time"));
        }
        let number = self.number + 1;
        let digest = sealed(self.digest(), number);
        self.finish(number, scene_time_s, digest);
        Ok(Update { number, scene_time_s, pose_seq, edits: draft.edits, next: NextSteps::default(), digest })
    }

    fn stage(&self, edits: &[Edit], limits: &Limits) -> Result<Changes, HeldError> {
        let mut staged = Staged::new(self, limits);
        for (index, edit) in edits.iter().enumerate() {
            if matches!(edit, Edit::Clear) && index > 0 {
                return Err(HeldError::LateClear);
            }
            staged.edit(edit)?;
        }
        Ok(Changes {
            cleared: staged.cleared,
            patches: staged.patches,
            poses: staged.poses,
            bodies: staged.bodies,
            instances: staged.instances,
            materials: staged.materials,
            lighting: staged.lighting,
            sky: staged.sky,
            last_patch: staged.last_patch,
            samples: staged.samples,
            pixels: staged.pixels,
            digest: staged.digest.0,
        })
    }

    fn take_over(&mut self, changes: Changes) {
        if changes.cleared {
            *self = Held { number: self.number, scene_time_s: self.scene_time_s, ..Held::default() };
        }
        for (id, patch) in changes.patches {
            match patch {
                Some(patch) => self.patches.insert(id, patch),
                None => self.patches.remove(&id),
            };
        }
        self.bodies.extend(changes.bodies);
        let patches = &self.patches;
        self.bodies.retain(|id, _| patches.contains_key(id));
        self.poses_now.extend(changes.poses);
        for (key, instance) in changes.instances {
            match instance {
                Some(instance) => self.instances.insert(key, instance),
                None => self.instances.remove(&key),
            };
        }
        if let Some(materials) = changes.materials {
            self.materials = materials;
        }
        if changes.sky.is_some() {
            self.sky = changes.sky;
        }
        if changes.lighting.is_some() {
            self.lighting = changes.lighting;
        }
        self.last_patch = changes.last_patch;
        self.samples = changes.samples;
        self.pixels = changes.pixels;
        self.digest = Some(changes.digest);
    }

    fn finish(&mut self, number: u64, scene_time_s: f64, digest: u64) {
        self.number = number;
        self.scene_time_s = scene_time_s;
        self.digest = Some(digest);
    }

    /// The running digest over every edit so far; equal at both ends after the same updates.
    pub fn digest(&self) -> u64 {
        self.digest.unwrap_or(EMPTY)
    }

    /// How many samples are held.
    pub fn sample_count(&self) -> usize {
        self.samples
    }
}

/// The digest of an update: of its edits, then of its number.
fn sealed(digest: u64, number: u64) -> u64 {
    let mut digest = Digest(digest);
    digest.number(number);
    digest.0
}

/// [`Staged`] without its hold on the base.
struct Changes {
    cleared: bool,
    patches: BTreeMap<PatchId, Option<HeldPatch>>,
    poses: BTreeMap<u16, DAffine3>,
    bodies: BTreeMap<PatchId, Arc<Body>>,
    instances: BTreeMap<(u16, PatchId), Option<HeldInstance>>,
    materials: Option<Vec<crate::look::Material>>,
    lighting: Option<crate::look::Lighting>,
    sky: Option<Arc<Sky>>,
    last_patch: Option<PatchId>,
    samples: usize,
    pixels: usize,
    digest: u64,
}

impl<'a> Staged<'a> {
    fn new(base: &'a Held, limits: &'a Limits) -> Staged<'a> {
        Staged {
            base,
            limits,
            cleared: false,
            patches: BTreeMap::new(),
            poses: BTreeMap::new(),
            bodies: BTreeMap::new(),
            instances: BTreeMap::new(),
            materials: None,
            lighting: None,
            sky: None,
            last_patch: base.last_patch,
            count: base.patches.len(),
            samples: base.samples,
            pixels: base.pixels,
            digest: Digest(base.digest()),
        }
    }

    fn edit(&mut self, edit: &Edit) -> Result<(), HeldError> {
        match edit {
            Edit::Clear => {
                self.cleared = true;
                (self.count, self.samples, self.pixels) = (0, 0, 0);
                self.last_patch = None;
                self.bodies.clear();
            }
            Edit::Add(patch) => self.add(patch)?,
            Edit::Remove(id) => {
                let held = self.held(*id).ok_or(HeldError::UnknownPatch(*id))?;
                let (samples, pixels) = (held.patch.image.sample_count(), pixels(&held.patch.image.mask));
                self.patches.insert(*id, None);
                self.bodies.remove(id);
                self.count -= 1;
                self.samples -= samples;
                self.pixels -= pixels;
            }
            Edit::Delete(id, addresses) => {
                ascending(*id, addresses.iter().copied())?;
                let held = self.held_mut(*id)?;
                held.delete(addresses)?;
                self.samples -= addresses.len();
            }
            Edit::Trim(id, trims) => {
                ascending(*id, trims.iter().map(|&(x, y, _)| (x, y)))?;
                self.held_mut(*id)?.trim(trims)?;
            }
            Edit::Move(poses) => {
                self.place_objects(poses)?;
            }
            Edit::Shift(shifts) => {
                let pose = |shift: &ObjectShift| {
                    let from = self.pose(shift.object).ok_or(HeldError::UnknownPose(shift.object))?;
                    Ok(ObjectPose { object: shift.object, world_from_object: shift.from(&from) })
                };
                let poses: Vec<ObjectPose> = shifts.iter().map(pose).collect::<Result<_, _>>()?;
                self.place_objects(&poses)?;
            }
            Edit::Body(id, body) => self.body(*id, body)?,
            Edit::Place(relief, instances) => self.place(*relief, instances)?,
            Edit::Withdraw(objects) => {
                for &object in objects {
                    let shown = self.shown(object);
                    if shown.is_empty() {
                        return Err(HeldError::NoInstance(object));
                    }
                    self.instances.extend(shown.into_iter().map(|key| (key, None)));
                }
            }
            Edit::Materials(materials) => {
                if materials.len() > self.limits.materials {
                    return Err(HeldError::TooMuch("materials"));
                }
                self.materials = Some(materials.clone());
            }
            Edit::Light(lighting) => {
                if lighting.lights.len() > crate::look::Lighting::MAX_LIGHTS {
                    return Err(HeldError::TooMuch("lights"));
                }
                self.lighting = Some(lighting.as_ref().clone());
            }
            Edit::Sky(sky) => {
                if !sky.is_whole() {
                    return Err(HeldError::SkyNotWhole);
                }
                self.sky = Some(sky.clone());
            }
            // Only the digest changes.
            Edit::Join(_) => {}
        }
        self.digest.edit(edit);
        Ok(())
    }

    /// Where an object is after the edits so far.
    fn pose(&self, object: u16) -> Option<DAffine3> {
        let before = || self.base.poses_now.get(&object).filter(|_| !self.cleared);
        self.poses.get(&object).or_else(before).copied()
    }

    fn place_objects(&mut self, poses: &[ObjectPose]) -> Result<(), HeldError> {
        check_poses(poses)?;
        self.poses.extend(poses.iter().map(|pose| (pose.object, pose.world_from_object)));
        Ok(())
    }

    fn add(&mut self, patch: &Patch) -> Result<(), HeldError> {
        if self.last_patch.is_some_and(|last| patch.id <= last) {
            return Err(HeldError::PatchIdUsed(patch.id));
        }
        check_patch(patch)?;
        self.count += 1;
        self.samples += patch.image.sample_count();
        self.pixels += pixels(&patch.image.mask);
        if self.count > self.limits.held_patches {
            return Err(HeldError::TooMuch("patches"));
        }
        if self.samples > self.limits.held_samples {
            return Err(HeldError::TooMuch("samples"));
        }
        if self.pixels > self.limits.held_pixels {
            return Err(HeldError::TooMuch("mask pixels"));
        }
        self.last_patch = Some(patch.id);
        self.patches.insert(patch.id, Some(HeldPatch { patch: patch.clone(), trims: Vec::new() }));
        Ok(())
    }

    fn body(&mut self, id: PatchId, body: &Arc<Body>) -> Result<(), HeldError> {
        let held = self.held(id).ok_or(HeldError::UnknownPatch(id))?;
        let has_some = self.bodies.contains_key(&id) || !self.cleared && self.base.bodies.contains_key(&id);
        if held.patch.purpose != Purpose::Body || has_some {
            return Err(HeldError::NoBody(id));
        }
        if !body.is_whole() {
            return Err(HeldError::BodyNotWhole(id));
        }
        self.bodies.insert(id, body.clone());
        // Those that this update removes still count.
        let before = self.base.bodies.values().filter(|_| !self.cleared);
        let sums = before.chain(self.bodies.values()).fold([0; 3], |[vertices, indices, numbers], body| {
            let of_clip = body.skin.as_ref().map_or(0, |skin| skin.clip.codes.len());
            [vertices + body.positions.len(), indices + body.indices.len(), numbers + of_clip]
        });
        let Limits { body_vertices, body_indices, body_clip_numbers, .. } = *self.limits;
        let names = ["vertices of bodies", "indices of bodies", "numbers of clips"];
        let most = [body_vertices, body_indices, body_clip_numbers];
        let past = sums.into_iter().zip(most).zip(names).find(|((sum, most), _)| sum > most);
        past.map_or(Ok(()), |(_, name)| Err(HeldError::TooMuch(name)))
    }

    fn place(&mut self, relief: PatchId, instances: &[Instance]) -> Result<(), HeldError> {
        let held = self.held(relief).ok_or(HeldError::UnknownPatch(relief))?;
        if !matches!(held.patch.purpose, Purpose::Relief(_) | Purpose::Body) {
            return Err(HeldError::NoRelief(relief));
        }
        let poses: Vec<ObjectPose> = instances.iter().map(|instance| instance.pose).collect();
        check_poses(&poses)?;
        // Rays go into the object's space.
        if !poses.iter().all(|pose| pose.world_from_object.inverse().is_finite()) {
            return Err(HeldError::NotFinite("inverse of an instance's pose"));
        }
        self.instances.extend(instances.iter().map(|&Instance { pose, tint }| {
            let instance = HeldInstance { world_from_object: pose.world_from_object, tint };
            ((pose.object, relief), Some(instance))
        }));
        Ok(())
    }

    /// An object with the reliefs that show it.
    fn shown(&self, object: u16) -> Vec<(u16, PatchId)> {
        let all = (object, PatchId(0))..=(object, PatchId(u32::MAX));
        let staged = self.instances.range(all.clone()).filter(|(_, instance)| instance.is_some()).map(|(key, _)| *key);
        let base = self.base.instances.range(all).map(|(key, _)| *key);
        base.filter(|key| !self.cleared && !self.instances.contains_key(key)).chain(staged).collect()
    }

    fn held(&self, id: PatchId) -> Option<&HeldPatch> {
        match self.patches.get(&id) {
            Some(staged) => staged.as_ref(),
            None if self.cleared => None,
            None => self.base.patches.get(&id),
        }
    }

    fn held_mut(&mut self, id: PatchId) -> Result<&mut HeldPatch, HeldError> {
        let held = match self.patches.remove(&id) {
            Some(staged) => staged,
            None => self.held(id).cloned(),
        };
        self.patches.entry(id).insert_entry(held).into_mut().as_mut().ok_or(HeldError::UnknownPatch(id))
    }
}

impl HeldPatch {
    /// Forgets samples; `addresses` ascend.
    fn delete(&mut self, addresses: &[(u16, u16)]) -> Result<(), HeldError> {
        let id = self.patch.id;
        let image = &mut self.patch.image;
        let mut keep = vec![true; image.sample_count()];
        let ranks = Ranks::new(&image.mask);
        for &(x, y) in addresses {
            keep[ranks.of(&image.mask, x, y).ok_or(HeldError::NoSample { patch: id, x, y })?] = false;
        }
        image.retain(&keep);
        if !self.trims.is_empty() {
            retain(&mut self.trims, &keep);
        }
        Ok(())
    }

    fn trim(&mut self, trims: &[(u16, u16, u8)]) -> Result<(), HeldError> {
        let id = self.patch.id;
        if self.trims.is_empty() {
            self.trims = vec![0; self.patch.image.sample_count()];
        }
        let ranks = Ranks::new(&self.patch.image.mask);
        for &(x, y, extent) in trims {
            if extent > Edit::MAX_TRIM {
                return Err(HeldError::TrimTooFar { patch: id, extent });
            }
            let rank = ranks.of(&self.patch.image.mask, x, y).ok_or(HeldError::NoSample { patch: id, x, y })?;
            self.trims[rank] = extent;
        }
        Ok(())
    }
}

fn pixels(mask: &Mask) -> usize {
    mask.size_px().0 as usize * mask.size_px().1 as usize
}

/// Addresses must ascend row by row, which also says that none comes twice.
fn ascending(id: PatchId, addresses: impl Iterator<Item = (u16, u16)>) -> Result<(), HeldError> {
    if addresses.map(|(x, y)| (y, x)).is_sorted_by(|a, b| a < b) { Ok(()) } else { Err(HeldError::NotAscending(id)) }
}

fn check_poses(poses: &[ObjectPose]) -> Result<(), HeldError> {
    let ordered = poses.is_sorted_by(|a, b| a.object < b.object);
    if !ordered {
        return Err(HeldError::ObjectsNotAscending);
    }
    if poses.iter().all(|pose| pose.world_from_object.is_finite()) {
        Ok(())
    } else {
        Err(HeldError::NotFinite("object pose"))
    }
}

fn check_next(next: &NextSteps) -> Result<(), HeldError> {
    if !next.objects.is_sorted_by(|a, b| a.object < b.object) {
        return Err(HeldError::ObjectsNotAscending);
    }
    let mut steps = next.objects.iter().flat_map(|object| object.steps);
    let is_finite = steps.all(|step| step.way_world.is_finite() && step.turn_world.is_finite());
    if next.objects.is_empty() || next.step_s > 0.0 && next.step_s.is_finite() && is_finite {
        Ok(())
    } else {
        Err(HeldError::NotFinite("next step of an object"))
    }
}

fn check_patch(patch: &Patch) -> Result<(), HeldError> {
    let DepthImage {
        camera,
        depth_scale,
        mask,
        depth,
        normal,
        normal_rest,
        ends,
        colour,
        colour_rest,
        object,
        material,
        share,
    } = &patch.image;
    let planes = [depth.len(), normal.len(), colour.len(), object.len(), material.len()];
    let some = [normal_rest.len(), ends.len(), colour_rest.len(), share.len()];
    let differs = |length: &usize| *length != mask.count();
    let is_whole = !planes.iter().any(differs) && !some.iter().filter(|&&length| length > 0).any(differs);
    if camera.size_px() != mask.size_px() || !is_whole {
        return Err(HeldError::PlanesDiffer(patch.id));
    }
    if !camera.is_valid() {
        return Err(HeldError::NotFinite("camera"));
    }
    let is_surface = matches!(patch.purpose, Purpose::Eye | Purpose::Layer(_) | Purpose::Light(_) | Purpose::Rest);
    let is_fit = match camera {
        Camera::Pinhole(_) => true,
        Camera::Spoc(_) => !is_surface,
        Camera::Graph(camera) => {
            let fits = !is_surface && !matches!(patch.purpose, Purpose::Relief(_));
            fits && is_graph_encodable(camera)
        }
    };
    if !is_fit {
        return Err(HeldError::CameraUnfit(patch.id));
    }
    let scale_holds = depth_scale.w_min.is_finite() && depth_scale.w_step.is_finite() && depth_scale.w_step >= 0.0;
    if !scale_holds || !patch.capture_time_s.is_finite() {
        return Err(HeldError::NotFinite("depth scale or capture time"));
    }
    check_poses(&patch.objects)
}
