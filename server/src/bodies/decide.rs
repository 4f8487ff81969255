//! Which objects a viewer is better sent as bodies.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use protocol::PatchId;
use scene::{Scene, Snapshot};

use super::store::{Bodies, Shape};
use crate::allowance::Allowance;
use crate::discretize::Capture;
use crate::portions::BYTES_PER_SAMPLE;
use crate::whereabouts::bounds_of;

/// Of the disc of a ball around an object, about what the object fills.
const FILLED: f64 = 0.2;
/// How often what is seen of an object that is rigid is sampled: what it hides of itself comes into view, or is looked at more closely.
const TIMES_SAMPLED: f64 = 2.0;
/// About what it takes to place an object whose body is held.
const PLACE_BYTES: f64 = 60.0;
/// Pixels along the longer side of the image that tells what is seen.
pub const PROBE_PX: u32 = 192;

/// Who looks, from where.
#[derive(Debug, Clone, Copy)]
pub struct Eye {
    /// In world space.
    pub eye_world: DVec3,
    /// Of the output.
    pub focal_px: f64,
    /// Pixels of the output: more samples of an object than that are never sent.
    pub most_px: f64,
    /// How often a second what moves is sent anew.
    pub update_hz: f64,
    /// What of all samples this look sends: less than 1 of a coarse image, before which only a body comes that is less than the coarse samples of it.
    pub share: f64,
    /// What an update may bring of bodies that are not held.
    pub allowance: Allowance,
    /// Whether bodies may begin that take the path for a while: not while something waits for it.
    pub begins: bool,
}

impl Eye {
    /// Whether a look that sent so many bytes of bodies sends another one of so many.
    pub(super) fn takes(&self, bytes: f64, sent_bytes: f64) -> bool {
        self.allowance.is_all() || self.begins && sent_bytes + bytes <= self.allowance.bytes()
    }

    /// Whether a body of so many bytes is more than an update may bring, so that its object is sampled: it goes in one piece, and holds up all that follows.
    pub(super) fn is_too_slow_for(&self, bytes: f64) -> bool {
        bytes > self.allowance.bytes()
    }

    /// What a look takes for as many pixels of the output, in bytes.
    fn look_bytes(&self, px: f64) -> f64 {
        px.min(self.most_px) * BYTES_PER_SAMPLE * self.share
    }

    /// What sampling an object that bones bend takes, in bytes: a second of a sample a pixel at each update.
    fn bent_bytes(&self, ball: (DVec3, f64)) -> f64 {
        self.look_bytes(FILLED * self.disc_px(ball)) * if self.share < 1.0 { 1.0 } else { self.update_hz }
    }

    /// The same of one that is rigid, of which so many pixels are seen.
    fn rigid_bytes(&self, seen_px: f64) -> f64 {
        self.look_bytes(seen_px) * if self.share < 1.0 { 1.0 } else { TIMES_SAMPLED }
    }

    /// What a ball fills of the output, in pixels.
    fn disc_px(&self, (centre_world, radius_m): (DVec3, f64)) -> f64 {
        let distance_m = self.eye_world.distance(centre_world);
        let radius_px = self.focal_px * radius_m / distance_m.max(radius_m);
        std::f64::consts::PI * radius_px * radius_px
    }

    /// How many pixels of the output each object is seen in, by a [probe](PROBE_PX).
    pub fn seen_px(&self, probe: &Capture) -> BTreeMap<u16, f64> {
        let share = (self.focal_px / probe.camera.focal_px).powi(2);
        let mut seen = BTreeMap::new();
        for index in (0..probe.ids.len()).filter(|&index| probe.ids[index][0] != 0) {
            *seen.entry(probe.object(index)).or_insert(0.0) += share;
        }
        seen
    }
}

/// A shape that a viewer is better sent as it is, and which of its objects it is to show from now on.
pub(super) struct Wanted<'a> {
    pub shape: &'a Shape,
    /// Ids ascend.
    pub objects: Vec<u16>,
    /// What sampling these takes.
    pub sampled_bytes: f64,
}

/// What is decided about: a scene at a time, who looks, and what he holds.
pub(super) struct Question<'a> {
    pub scene: &'a Scene,
    pub snapshot: &'a Snapshot,
    pub codes: &'a [Option<u8>],
    pub eye: &'a Eye,
    /// The objects that he is shown otherwise.
    pub shown: &'a BTreeSet<u16>,
    /// The bodies that he holds, by the first object of their shape.
    pub held: &'a BTreeMap<u16, PatchId>,
}

impl<'a> Question<'a> {
    /// Whether an image must tell what is seen: whether something rigid is near enough to matter that is not shown.
    pub fn needs_probe(&self, bodies: &Bodies) -> bool {
        bodies.shapes.iter().any(|shape| {
            let left = || shape.objects.iter().filter(|object| !self.shown.contains(object));
            let bytes =
                |object: &u16| self.ball(*object).map_or(0.0, |ball| self.eye.rigid_bytes(self.eye.disc_px(ball)));
            !shape.is_rigged && !shape.is_unfit() && left().map(bytes).sum::<f64>() > self.least_bytes(shape)
        })
    }

    /// The shapes that a viewer is better sent as they are; `seen_px` is of each object. Where not all can be sent at once, those first that most is seen of.
    pub fn wanted(&self, bodies: &'a Bodies, seen_px: &BTreeMap<u16, f64>) -> Vec<Wanted<'a>> {
        let mut wanted: Vec<Wanted<'a>> =
            bodies.shapes.iter().filter_map(|shape| self.wanted_of(shape, seen_px)).collect();
        if !self.eye.allowance.is_all() {
            wanted.sort_by(|a, b| b.sampled_bytes.total_cmp(&a.sampled_bytes));
        }
        wanted
    }

    fn wanted_of(&self, shape: &'a Shape, seen_px: &BTreeMap<u16, f64>) -> Option<Wanted<'a>> {
        let bytes_of = |object: u16| {
            if shape.is_rigged {
                return self.ball(object).map_or(0.0, |ball| self.eye.bent_bytes(ball));
            }
            seen_px.get(&object).map_or(0.0, |&px| self.eye.rigid_bytes(px))
        };
        let left = shape.objects.iter().filter(|object| !self.shown.contains(object));
        let sampled: Vec<(u16, f64)> = left.map(|&object| (object, bytes_of(object))).collect();
        let worth: Vec<(u16, f64)> = sampled.into_iter().filter(|(_, bytes)| *bytes > PLACE_BYTES).collect();
        let bytes: f64 = worth.iter().map(|(_, bytes)| bytes - PLACE_BYTES).sum();
        // Not made before it is near enough to matter.
        let is_less = || shape.made(self.scene, self.codes).is_some_and(|made| bytes > made.bytes as f64);
        let is_wanted = !worth.is_empty() && (self.is_held(shape) || bytes > shape.least_bytes && is_less());
        let objects = worth.into_iter().map(|(object, _)| object).collect();
        is_wanted.then_some(Wanted { shape, objects, sampled_bytes: bytes })
    }

    fn least_bytes(&self, shape: &Shape) -> f64 {
        if self.is_held(shape) { PLACE_BYTES } else { shape.least_bytes }
    }

    fn is_held(&self, shape: &Shape) -> bool {
        self.held.contains_key(&shape.objects[0])
    }

    /// A ball around an object.
    fn ball(&self, object: u16) -> Option<(DVec3, f64)> {
        let bounds = bounds_of(self.scene, self.snapshot, object)?;
        Some((bounds.middle(), (bounds.max - bounds.min).length() / 2.0))
    }
}
