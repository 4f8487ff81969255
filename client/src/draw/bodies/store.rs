//! The bodies that a client holds, and the moment that they are shown at.

use std::collections::BTreeMap;

use camera::Bounds;
use glam::{DAffine3, Vec3};
use gpu::Gpu;
use protocol::body::BoneRows;
use protocol::{Body, Edit, Held, PatchId, Update};
use surface::BuiltSurfaces;

use super::placed::Placed;
use crate::receive::follow::Follow;

/// The bodies of what is held, on the GPU, and the moment that they are shown at.
#[derive(Debug)]
pub struct Bodies {
    gpu: Gpu,
    placed: BTreeMap<PatchId, Placed>,
    scene_time_s: f64,
    revision: u64,
}

impl Bodies {
    /// None yet.
    pub fn new(gpu: &Gpu) -> Bodies {
        Bodies { gpu: gpu.clone(), placed: BTreeMap::new(), scene_time_s: 0.0, revision: 0 }
    }

    /// Poses them as they are at a moment of scene time; whether that changes anything.
    pub fn show_at(&mut self, scene_time_s: f64) -> bool {
        let changes = self.is_other_at(scene_time_s);
        self.scene_time_s = scene_time_s;
        self.revision += u64::from(changes);
        changes
    }

    /// Whether another moment of scene time changes anything.
    pub fn is_other_at(&self, scene_time_s: f64) -> bool {
        scene_time_s != self.scene_time_s && self.placed.values().any(Placed::is_bent)
    }

    /// A number that grows with every change of what they show.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Puts up everything held, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.revision += 1;
        self.placed.clear();
        held.bodies.keys().for_each(|&id| self.hold(held, id));
    }

    fn hold(&mut self, held: &Held, id: PatchId) {
        // An update may take back what it brought.
        let Some((patch, body)) = held.patches.get(&id).zip(held.bodies.get(&id)) else { return };
        let (width_px, height_px) = patch.patch.image.mask.size_px();
        let most_px = self.gpu.device.limits().max_texture_dimension_2d;
        let pixels = u64::from(width_px) * u64::from(height_px);
        let held_px: u64 = self.placed.values().map(|placed| placed.pixels).sum();
        // Before anything is allocated: a mask costs a bit a pixel, an image on the GPU some forty times as much.
        if width_px.max(height_px) > most_px || held_px + pixels > Body::MOST_PIXELS || body.indices.is_empty() {
            return say(id);
        }
        self.revision += 1;
        self.placed.insert(id, Placed::new(&self.gpu, &patch.patch.image, body.clone()));
    }

    /// Each object that a body shows, with which, where it stands and how it is tinted.
    pub(super) fn shown<'a>(
        &'a self,
        held: &'a Held,
    ) -> impl Iterator<Item = (u16, PatchId, &'a Placed, &'a protocol::HeldInstance)> {
        let shown = |(&(object, id), instance)| Some((object, id, self.placed.get(&id)?, instance));
        held.instances.iter().filter_map(shown)
    }

    /// The maps of a body's bones at the moment that is shown.
    pub(super) fn bones(&self, placed: &Placed) -> Vec<BoneRows> {
        placed.body.skin.as_ref().map_or(Vec::new(), |skin| skin.clip.at(self.scene_time_s))
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn say(id: PatchId) {
    tracing::warn!("the body of {id:?} is not shown: it is empty, or its image is too large");
}

#[cfg(target_arch = "wasm32")]
fn say(_: PatchId) {}

/// Where an object is: what bones bend is placed by them, and does not move beside that.
pub(super) fn world_from_object(
    placed: &Placed,
    (object, instance): (u16, &protocol::HeldInstance),
    poses_now: &BTreeMap<u16, DAffine3>,
) -> DAffine3 {
    let pose = if placed.is_bent() { None } else { poses_now.get(&object) };
    *pose.unwrap_or(&instance.world_from_object)
}

/// A box around all that bodies show at any time, in world space; `None` where they show nothing.
pub(crate) fn bounds_world(bodies: &Bodies, held: &Held, poses_now: &BTreeMap<u16, DAffine3>) -> Option<Bounds> {
    let of_object = |(object, _, placed, instance): (u16, PatchId, &Placed, &protocol::HeldInstance)| {
        let world_from_body = world_from_object(placed, (object, instance), poses_now);
        let [low, high] = placed.body.bounds.map(|corner| Vec3::from(corner).as_dvec3());
        let bounds = Bounds { min: low, max: high };
        let bounds = Bounds::around(bounds.corners().map(|p| world_from_body.transform_point3(p)))?;
        (bounds.min.is_finite() && bounds.max.is_finite()).then_some(bounds)
    };
    bodies.shown(held).filter_map(of_object).reduce(Bounds::union)
}

impl Follow for Bodies {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, _: &mut BuiltSurfaces) {
        if anew {
            return self.rebuild(held);
        }
        for edit in &update.edits {
            match edit {
                Edit::Clear => self.placed.clear(),
                Edit::Body(id, _) => self.hold(held, *id),
                Edit::Remove(id) => self.revision += u64::from(self.placed.remove(id).is_some()),
                Edit::Place(id, _) => self.revision += u64::from(self.placed.contains_key(id)),
                Edit::Withdraw(_) => self.revision += 1,
                _ => {}
            }
        }
    }
}
