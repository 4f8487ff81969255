//! The account of one client: the server's copy of what it holds, and the edits that bring it up to date.
//!
//! What the client holds counts as sampled. For each view of a plan the copy is drawn as the client would draw it
//! ([`surface::AddressPass`]) and laid beside the scene ([`compare`]): what covers falsely is trimmed, the copy is drawn
//! again, and what is then still missing or too coarse is sent. What deformed away from where it was captured is deleted
//! before (`deforming.rs`). So a viewer pays only for surface that comes into view for the first time, or must get finer, or deformed.
//!
//! The copy is exact: it takes each edit as the client will, after coding, and both fold it into the same digest. Trims and
//! deletes go over the wire; a client never derives them from its own pictures, as GPUs differ.
//!
//! A trim never removes a sample, whose centre is a true hit: its extent shrinks, at most
//! to `2^-`[`Edit::MAX_TRIM`], so taking back comes to an end.

pub mod compare;
mod counts;
mod deforming;
mod drawn;
pub mod facts;
pub mod findings;
mod past;
mod placed;
mod record;
mod repeat;
mod room;
mod rules;
pub mod samples;
mod superseded;

pub use counts::{Counts, LightCounts, OccluderCounts};
pub use deforming::Deforming;
pub use past::Past;
pub use rules::AccountRules;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use camera::{Camera, ImagePoint, Pinhole};
use glam::DVec3;
use gpu::Gpu;
use protocol::codec::ColourSteps;
use protocol::held::{Draft, Edit, Held, HeldError, ObjectPose, Patch, PatchId, Purpose, Update};
use protocol::{DepthImage, Lighting, Mask, Material, ObjectShift, Sky};
use surface::{AddressView, HeldSurfaces};

use crate::discretize::{Capture, DepthPrecision};
use drawn::Drawn;
use facts::Facts;
use findings::Lacking;
use record::Record;
use samples::{Address, Captured, Samples};

/// What one sample costs a client, in bytes: 12 of planes with its extent, 8 of its place, 1.4 vertices of 36 and six indices of 4, and a third of a vertex and of as many
/// indices for levels.
pub const BYTES_PER_SAMPLE: u64 = 114;

/// See the module.
#[derive(Debug, Default)]
pub struct Account {
    held: Held,
    /// Draws the copy; nothing before the first update, and with an imager that has no GPU.
    drawn: Drawn,
    known: Known,
    draft: Draft,
    broken: bool,
    counts: Counts,
    past: Past,
}

/// What an account knows beside what is held.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Accounts that came to the same share them.
    records: BTreeMap<PatchId, Arc<Record>>,
    last_patch: u32,
    /// That the codes of depths take at most, of what the eye sees.
    depth_bits: u32,
    /// Counts updates in the making: what the copy showed when.
    look: u32,
    /// The one that sent the first set.
    first_look: u32,
}

/// What the scene is at the time of an update, beside its surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// How exactly colours are kept.
    pub colour: ColourSteps,
    /// Scene time.
    pub time_s: f64,
    /// What the material codes mean.
    pub materials: &'a [Material],
    /// The lights.
    pub lighting: &'a Lighting,
    /// Light from all around, if the look has any.
    pub sky: Option<&'a Arc<Sky>>,
    /// Where the moving rigid objects are; ids ascend.
    pub moving: &'a [ObjectPose],
    /// Where the triangles of deforming objects are.
    pub deforming: &'a Deforming<'a>,
}

impl Account {
    /// What draws the copy as far as it is for one purpose, from its first look on. Surfaces that lie in the copy already are not in it.
    pub fn draw_with(&mut self, purpose: Purpose, surfaces: impl FnOnce() -> Option<HeldSurfaces>) {
        self.drawn.draw(purpose, surfaces);
        self.drawn.set_materials(&self.held.materials);
        self.drawn.set_poses(&self.held.poses_now);
    }

    /// Keeps what is known of the eye's samples on the GPU from now on, for comparisons there.
    pub fn know_on(&mut self, gpu: &Gpu) {
        self.drawn.know(gpu, &self.held);
    }

    /// See [`Account::know_on`]; up to date after [`Account::refresh`].
    pub fn facts(&self) -> Option<&Facts> {
        self.drawn.facts()
    }

    /// The copy.
    pub fn held(&self) -> &Held {
        &self.held
    }

    /// What draws it, as far as it is for one purpose.
    pub fn surfaces(&self, purpose: Purpose) -> Option<&HeldSurfaces> {
        self.drawn.of(purpose)
    }

    /// Of a client whose updates count on from those of another one; the first clears what that one's followers hold.
    pub fn after(number: u64) -> Account {
        let mut held = Held::default();
        held.number = number;
        Account { held, broken: true, past: Past::Own, ..Account::default() }
    }

    /// What drew the copy is lost with its device. The next update must start anew.
    pub fn leave_device(&mut self) {
        self.drawn = Drawn::default();
    }

    /// The client's copy is broken: the next update starts anew. The old picture stays on its screen until then.
    pub fn start_anew(&mut self) {
        self.broken = true;
        self.past = Past::Own;
    }

    /// Begins an update with a look.
    pub fn begin(&mut self, now: &Surroundings<'_>) -> Result<(), HeldError> {
        self.past = Past::Own;
        self.known.look += 1;
        self.begin_rest(now)
    }

    /// Begins an update: tables, lights and moved objects where they changed. What the eye is shown of deforming objects goes where it moved.
    pub fn begin_rest(&mut self, now: &Surroundings<'_>) -> Result<(), HeldError> {
        self.begin_draft();
        if std::mem::take(&mut self.broken) {
            self.held.edit(Edit::Clear, &mut self.draft)?;
            self.known.records.clear();
            self.drawn.clear();
        }
        if self.held.materials != now.materials {
            self.held.edit(Edit::Materials(now.materials.to_vec()), &mut self.draft)?;
            self.drawn.set_materials(now.materials);
        }
        if let Some(sky) = now.sky.filter(|sky| !self.held.sky.as_ref().is_some_and(|held| Arc::ptr_eq(held, sky))) {
            self.held.edit(Edit::Sky(sky.clone()), &mut self.draft)?;
        }
        if self.held.lighting.as_ref() != Some(now.lighting) {
            self.held.edit(Edit::Light(Box::new(now.lighting.clone())), &mut self.draft)?;
        }
        let differs = |pose: &&ObjectPose| self.held.poses_now.get(&pose.object) != Some(&pose.world_from_object);
        let by_clip = self.moved_by_clips();
        let moved = now.moving.iter().filter(differs).filter(|pose| !by_clip.contains(&pose.object));
        let way = |pose: &ObjectPose| {
            let from = self.held.poses_now.get(&pose.object)?;
            ObjectShift::between(pose.object, from, &pose.world_from_object)
        };
        let (mut poses, mut shifts) = (Vec::new(), Vec::new());
        moved.for_each(|pose| way(pose).map_or_else(|| poses.push(*pose), |shift| shifts.push(shift)));
        let has_moved = !poses.is_empty() || !shifts.is_empty();
        if !poses.is_empty() {
            self.held.edit(Edit::Move(poses), &mut self.draft)?;
        }
        if !shifts.is_empty() {
            self.held.edit(Edit::Shift(shifts), &mut self.draft)?;
        }
        if has_moved {
            self.drawn.set_poses(&self.held.poses_now);
        }
        self.delete_moved(Purpose::Eye, now)?;
        (0..Purpose::LAYERS).try_for_each(|layer| self.delete_moved(Purpose::Layer(layer), now))
    }

    /// Removes everything but what lights see, what only occludes and what a viewer at rest is shown, to be sent anew.
    pub fn forget(&mut self) -> Result<(), HeldError> {
        self.withdraw(self.shown_otherwise().into_iter().collect())?;
        self.known.first_look = self.known.look;
        self.remove_where(|purpose| !matches!(purpose, Purpose::Light(_) | Purpose::Occluders | Purpose::Rest))
    }

    /// Removes all that is held for some purposes.
    pub fn remove_where(&mut self, is_meant: impl Fn(Purpose) -> bool) -> Result<(), HeldError> {
        let meant = self.held.patches.iter().filter(|(_, held)| is_meant(held.patch.purpose));
        for id in meant.map(|(id, _)| *id).collect::<Vec<_>>() {
            self.held.edit(Edit::Remove(id), &mut self.draft)?;
            self.known.records.remove(&id);
            self.drawn.remove(id);
        }
        Ok(())
    }

    /// Takes back what covers falsely, by halving its extent; addresses ascend. Whether the copy changed.
    pub fn retract(&mut self, purpose: Purpose, false_cover: &[Address]) -> Result<bool, HeldError> {
        let mut trims: BTreeMap<PatchId, Vec<(u16, u16, u8)>> = BTreeMap::new();
        for &(patch, x, y) in false_cover {
            let Some(record) = self.known.records.get_mut(&patch).map(Arc::make_mut) else { continue };
            // Once an update: a sample that two views of one plan see covering falsely shrinks by one step.
            if let Some(extent) = record.trim(x, y, self.known.look) {
                trims.entry(patch).or_default().push((x, y, extent));
            }
        }
        let changed = !trims.is_empty();
        for (patch, trims) in trims {
            self.counts.trim(purpose, trims.len());
            self.drawn.trim(patch, trims.iter().map(|&(x, y, _)| (x, y)));
            self.held.edit(Edit::Trim(patch, trims), &mut self.draft)?;
        }
        Ok(changed)
    }

    /// Adds what is lacking of a view, and deletes what that replaces.
    pub fn add(
        &mut self,
        purpose: Purpose,
        capture: &Capture,
        lacking: &Lacking,
        precision: DepthPrecision,
        now: &Surroundings<'_>,
    ) -> Result<(), HeldError> {
        self.counts.add(purpose, lacking);
        self.counts.delete(purpose, lacking.replaced.len());
        self.delete(&lacking.replaced)?;
        let Some((mask, origin)) = cropped(&lacking.send) else { return Ok(()) };
        let cropped = capture.cropped(origin, mask.size_px());
        let mut image = cropped.depth_image_of(mask.clone(), precision);
        if !purpose.is_for_eyes() {
            without_look(&mut image);
        }
        now.colour.settle_all(&mut image.colour);
        self.known.last_patch += 1;
        let id = PatchId(self.known.last_patch);
        if purpose == Purpose::Eye {
            let most = image.depth.iter().copied().max().unwrap_or_default();
            self.known.depth_bits = self.known.depth_bits.max(u16::BITS - most.leading_zeros());
        }
        let patch = Patch { id, purpose, capture_time_s: now.time_s, objects: objects_in(&image, now.moving), image };
        let triangles = mask.occupied().map(|(x, y)| cropped.triangle_at(x as i32, y as i32)).collect();
        let record = Record::new(&patch.image, &cropped.camera, triangles, self.known.look, now.deforming);
        self.known.records.insert(id, Arc::new(record));
        self.held.edit(Edit::Add(Box::new(patch)), &mut self.draft)?;
        self.drawn.change(id);
        Ok(())
    }

    /// Says that a light casts nothing: by a patch of it without a sample.
    pub fn add_nothing(&mut self, light: u16, now: &Surroundings<'_>) -> Result<(), HeldError> {
        self.known.last_patch += 1;
        let (id, purpose, objects) = (PatchId(self.known.last_patch), Purpose::Light(light), Vec::new());
        let image = DepthImage::without_samples();
        let patch = Patch { id, purpose, capture_time_s: now.time_s, objects, image };
        self.held.edit(Edit::Add(Box::new(patch)), &mut self.draft)
    }

    /// Adds an impostor. It is no surface: it is neither drawn nor looked at again, and stays until it is removed.
    pub fn add_impostor(
        &mut self,
        image: DepthImage,
        purpose: Purpose,
        now: &Surroundings<'_>,
    ) -> Result<PatchId, HeldError> {
        let objects = objects_in(&image, now.moving);
        self.add_whole(image, purpose, objects, now)
    }

    /// Adds an image that is looked at as a whole: no sample of it is edited.
    fn add_whole(
        &mut self,
        mut image: DepthImage,
        purpose: Purpose,
        objects: Vec<ObjectPose>,
        now: &Surroundings<'_>,
    ) -> Result<PatchId, HeldError> {
        now.colour.settle_all(&mut image.colour);
        self.known.last_patch += 1;
        let id = PatchId(self.known.last_patch);
        *if purpose == Purpose::Rest { &mut self.counts.rest } else { &mut self.counts.impostor } +=
            image.sample_count();
        let patch = Patch { id, purpose, capture_time_s: now.time_s, objects, image };
        self.held.edit(Edit::Add(Box::new(patch)), &mut self.draft)?;
        Ok(id)
    }

    /// Adds rows of a viewer's own view at rest. They are no surface either.
    pub fn add_rest(&mut self, mut image: DepthImage, now: &Surroundings<'_>) -> Result<PatchId, HeldError> {
        let objects = objects_in(&image, now.moving);
        if now.colour != ColourSteps::Lossless {
            // Nothing is left off of colours that move.
            image.colour_rest.clear();
        }
        self.add_whole(image, Purpose::Rest, objects, now)
    }

    /// Removes an impostor, or rows of a view at rest, that the client still holds.
    pub fn remove_whole(&mut self, id: PatchId) -> Result<(), HeldError> {
        if self.held.patches.contains_key(&id) {
            self.held.edit(Edit::Remove(id), &mut self.draft)?;
        }
        Ok(())
    }

    /// The patches that were captured by some views, beside those of the first set.
    pub fn captured_by(&self, views: &[Pinhole]) -> BTreeSet<PatchId> {
        let is_of = |camera: &Camera| views.iter().any(|view| cut_from(view, camera).is_some());
        let is_later =
            |id: &PatchId| self.known.records.get(id).is_some_and(|record| record.added > self.known.first_look);
        let patches = self.held.patches.iter().filter(|(id, held)| is_later(id) && is_of(&held.patch.image.camera));
        patches.map(|(id, _)| *id).collect()
    }

    /// Marks what a view shows of the copy as in use.
    pub fn mark_seen(&mut self, view: &AddressView) {
        let mut last: Option<(PatchId, &mut Record)> = None;
        for (patch, x, y) in view.texels.iter().filter_map(surface::AddressTexel::address) {
            if last.as_ref().is_none_or(|(id, _)| *id != patch) {
                last = self.known.records.get_mut(&patch).map(|record| (patch, Arc::make_mut(record)));
            }
            if let Some((_, record)) = &mut last {
                record.see(x, y, self.known.look);
            }
        }
    }

    /// Marks what this update added last as never seen.
    pub fn mark_added_unseen(&mut self) {
        let look = self.known.look;
        let last = self.known.records.get_mut(&PatchId(self.known.last_patch));
        if let Some(record) = last.filter(|record| record.added == look) {
            Arc::make_mut(record).forget_seen();
        }
    }

    /// Ends the update; `None` where there is nothing to say: nothing changed, and no animated scene moved on.
    pub fn seal(&mut self, scene_time_s: f64, pose_seq: u64, animated: bool) -> Result<Option<Update>, HeldError> {
        let draft = std::mem::take(&mut self.draft);
        let moved_on = animated && scene_time_s != self.held.scene_time_s;
        if draft.edits().is_empty() && !moved_on && self.held.number > 0 {
            return Ok(None);
        }
        self.held.seal(draft, scene_time_s, pose_seq).map(Some)
    }

    /// How many bits the codes of depths took at most, of what the eye sees; 0 before any.
    pub fn depth_bits(&self) -> u32 {
        self.known.depth_bits
    }

    /// Updates that were begun.
    pub fn looks(&self) -> usize {
        self.known.look as usize
    }

    /// What the edits of the update did so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The edits of the update so far.
    pub fn edits(&self) -> usize {
        self.draft.edits().len()
    }

    /// The counts, to be added to.
    pub fn counts_mut(&mut self) -> &mut Counts {
        &mut self.counts
    }

    /// Deletes what a view has superseded, see [`Account::superseded`].
    pub fn supersede(&mut self, superseded: &[Address]) -> Result<(), HeldError> {
        self.counts.deleted += superseded.len();
        self.delete(superseded)
    }

    /// Deletes samples; `addresses` ascend. A patch left without any is removed.
    fn delete(&mut self, addresses: &[Address]) -> Result<(), HeldError> {
        for of_patch in addresses.chunk_by(|a, b| a.0 == b.0) {
            let id = of_patch[0].0;
            let Some(held) = self.held.patches.get(&id) else { continue };
            if held.patch.image.sample_count() == of_patch.len() {
                self.held.edit(Edit::Remove(id), &mut self.draft)?;
                self.known.records.remove(&id);
                self.drawn.change(id);
            } else {
                let pixels: Vec<(u16, u16)> = of_patch.iter().map(|&(_, x, y)| (x, y)).collect();
                self.drawn.delete(held.patch.purpose, id, &pixels);
                self.held.edit(Edit::Delete(id, pixels), &mut self.draft)?;
            }
        }
        Ok(())
    }

    /// Brings what draws the copy up to date; call it before the copy is drawn.
    pub fn refresh(&mut self) {
        self.drawn.refresh(&self.held, &self.known.records);
    }
}

impl Samples for Account {
    fn captured(&self, (patch, x, y): Address) -> Captured {
        self.known.records.get(&patch).and_then(|record| record.captured(x, y)).unwrap_or(Captured::UNKNOWN)
    }

    fn centre_world(&self, (patch, x, y): Address, object: u16) -> Option<DVec3> {
        let w = self.known.records.get(&patch)?.w(x, y)?;
        let held = &self.held.patches.get(&patch)?.patch;
        let point = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w: w.into() };
        let captured = held.image.camera.world_from_image(point);
        let Some(pose) = held.objects.iter().find(|pose| pose.object == object) else { return Some(captured) };
        let now = self.held.poses_now.get(&object).unwrap_or(&pose.world_from_object);
        Some(now.transform_point3(pose.world_from_object.inverse().transform_point3(captured)))
    }

    fn sent_by(&self, camera: &Pinhole, purpose: Purpose) -> Vec<u32> {
        let mut triangles = vec![0; camera.width_px as usize * camera.height_px as usize];
        for (id, held) in self.held.patches.iter().filter(|(_, held)| held.patch.purpose == purpose) {
            let (patch, Some(record)) = (&held.patch, self.known.records.get(id)) else { continue };
            let Some(origin) = cut_from(camera, &patch.image.camera) else { continue };
            let carried = |pose: &&ObjectPose| self.held.poses_now.get(&pose.object) != Some(&pose.world_from_object);
            let carried: Vec<u16> = patch.objects.iter().filter(carried).map(|pose| pose.object).collect();
            for ((x, y), object) in patch.image.mask.occupied().zip(&patch.image.object) {
                if !carried.contains(object)
                    && let Some(triangle) = record.triangle(x as u16, y as u16)
                {
                    triangles[((y + origin.1) * camera.width_px + x + origin.0) as usize] = triangle;
                }
            }
        }
        triangles
    }
}

/// Where in a view's image a patch's begins, if it was cut from a view of this very camera.
pub fn cut_from(view: &Pinhole, patch: &Camera) -> Option<(u32, u32)> {
    let patch = patch.pinhole()?;
    let (x, y) = ((view.centre_px - patch.centre_px).x, (view.centre_px - patch.centre_px).y);
    let whole = |first: f64, length: u32, of: u32| {
        (first >= 0.0 && first.fract() == 0.0 && first + f64::from(length) <= f64::from(of)).then_some(first as u32)
    };
    let same = view.world_from_eye == patch.world_from_eye && view.focal_px == patch.focal_px;
    let origin = (whole(x, patch.width_px, view.width_px)?, whole(y, patch.height_px, view.height_px)?);
    same.then_some(origin)
}

/// The smallest mask that holds all of a mask's samples, and where it begins; `None` without any.
fn cropped(mask: &Mask) -> Option<(Mask, (u32, u32))> {
    let (first, last) = mask.occupied().fold(None, |bounds: Option<([u32; 2], [u32; 2])>, (x, y)| {
        let (low, high) = bounds.unwrap_or(([x, y], [x, y]));
        Some(([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]))
    })?;
    let mut crop = Mask::empty(last[0] - first[0] + 1, last[1] - first[1] + 1);
    mask.occupied().for_each(|(x, y)| crop.set(x - first[0], y - first[1], true));
    Some((crop, (first[0], first[1])))
}

/// The moving objects that have a sample in an image.
fn objects_in(image: &DepthImage, moving: &[ObjectPose]) -> Vec<ObjectPose> {
    if moving.is_empty() {
        return Vec::new();
    }
    let mut seen = vec![false; usize::from(u16::MAX) + 1];
    image.object.iter().for_each(|&object| seen[usize::from(object)] = true);
    moving.iter().copied().filter(|pose| seen[usize::from(pose.object)]).collect()
}

/// Takes from an image what only pictures of it need: colours, and normals finer than shadows need them. The codec leaves out what is one
/// value.
fn without_look(image: &mut DepthImage) {
    image.colour.fill([0; 3]);
    image.normal_rest.clear();
}
