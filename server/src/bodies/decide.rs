//! Which objects a viewer is better sent as bodies.

use glam::DVec3;
use scene::{Scene, Snapshot};

use super::store::Bodies;
use crate::whereabouts::bounds_of;

/// About what a sample costs on the wire, in bytes (report `codec`, the fast profile).
const BYTES_PER_SAMPLE: f64 = 3.0;
/// Of the disc of a ball around an object, about what the object fills.
const FILLED: f64 = 0.2;

/// Views that together see all sides of an object: the surface of a ball is four of its discs.
const SIDES: f64 = 4.0;

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
}

impl Eye {
    /// What sampling an object takes, in bytes: of what is bent, a second of a sample a pixel at each update; of what is rigid, once from all around.
    fn sampled_bytes(&self, (centre_world, radius_m): (DVec3, f64), is_bent: bool) -> f64 {
        let distance_m = self.eye_world.distance(centre_world);
        let radius_px = self.focal_px * radius_m / distance_m.max(radius_m);
        let samples = (FILLED * std::f64::consts::PI * radius_px * radius_px).min(self.most_px);
        samples * BYTES_PER_SAMPLE * if is_bent { self.update_hz } else { SIDES }
    }
}

/// The objects that a viewer is better sent as bodies; ids ascend. Those in `held` stay.
pub(super) fn wanted(
    bodies: &Bodies,
    (scene, snapshot): (&Scene, &Snapshot),
    codes: &[Option<u8>],
    eye: &Eye,
    held: impl Fn(u16) -> bool,
) -> Vec<u16> {
    let is_wanted = |&object: &u16| {
        held(object)
            || bounds_of(scene, snapshot, object).is_some_and(|bounds| {
                let ball = (bounds.middle(), (bounds.max - bounds.min).length() / 2.0);
                let bytes = eye.sampled_bytes(ball, scene.instances[usize::from(object)].deforms);
                // Not made before it is near enough to matter.
                bytes > LEAST_BYTES && bodies.made(object, scene, codes).is_some_and(|made| bytes > made.bytes as f64)
            })
    };
    bodies.candidates.keys().copied().filter(is_wanted).collect()
}

/// No body takes less.
const LEAST_BYTES: f64 = 1024.0;
