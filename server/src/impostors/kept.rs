use std::collections::BTreeMap;
use std::mem::{Discriminant, discriminant};

use camera::Camera;
use protocol::{Held, PatchId};

use super::wanted::{Basis, Decision, Drawn, Key, Wanted};

/// An impostor is remade when its subject turned by more than this under the camera's eye: past that, what a single-pole camera sees
/// behind the silhouette is used up on one side.
const TURNED_RAD: f64 = 0.1;
/// Or when the eye came nearer or went further by more than this share: then its pixels are too coarse, or too fine.
const DISTANCE_SHARE: f64 = 0.2;
/// What moves in an image of surroundings, or deforms, is followed this often.
const FOLLOWED_EVERY_S: f64 = 0.5;

/// The impostors that a client holds.
#[derive(Debug, Clone, Default)]
pub struct Kept {
    images: BTreeMap<Key, Image>,
    reasons: Vec<String>,
}

#[derive(Debug, Clone)]
struct Image {
    patch: PatchId,
    kind: Discriminant<Camera>,
    drawn: Drawn,
    basis: Basis,
    changes_at_s: Option<f64>,
}

impl Image {
    fn is_stale(&self, wanted: &Wanted) -> bool {
        let moved = match (self.basis, wanted.basis) {
            (Basis::Object(was), Basis::Object(is)) => {
                was.angle_between(is) > TURNED_RAD || (was.length() / is.length()).ln().abs() > DISTANCE_SHARE
            }
            (Basis::Place { eye_world, reach_m }, Basis::Place { eye_world: is, .. }) => {
                eye_world.distance(is) > reach_m
            }
            _ => true,
        };
        let aged = match (self.changes_at_s, wanted.changes_at_s) {
            (Some(was_s), Some(is_s)) => (is_s - was_s).abs() >= FOLLOWED_EVERY_S,
            (was, is) => was.is_some() != is.is_some(),
        };
        // Another choice was made.
        let differs = self.kind != discriminant(&wanted.camera) || self.drawn != wanted.drawn;
        moved || aged || differs
    }
}

impl Kept {
    /// What of a decision the client does not hold, or holds as it was too long ago.
    pub fn lacking<'a>(&self, decision: &'a Decision, held: &Held) -> Vec<&'a Wanted> {
        let is_fresh = |wanted: &&Wanted| {
            let image = self.images.get(&wanted.key).filter(|image| held.patches.contains_key(&image.patch));
            image.is_some_and(|image| !image.is_stale(wanted))
        };
        decision.wanted.iter().filter(|wanted| !is_fresh(wanted)).collect()
    }

    /// Notes that a patch was added; the one whose place it takes, if any.
    pub fn replace(&mut self, wanted: &Wanted, patch: PatchId) -> Option<PatchId> {
        let (kind, drawn) = (discriminant(&wanted.camera), wanted.drawn.clone());
        let image = Image { patch, kind, drawn, basis: wanted.basis, changes_at_s: wanted.changes_at_s };
        self.images.insert(wanted.key, image).map(|old| old.patch)
    }

    /// Forgets what a decision does not want any more.
    pub fn drop_unwanted(&mut self, decision: &Decision) -> Vec<PatchId> {
        let is_wanted = |key: &Key| decision.wanted.iter().any(|wanted| wanted.key == *key);
        let unwanted: Vec<Key> = self.images.keys().copied().filter(|key| !is_wanted(key)).collect();
        unwanted.iter().filter_map(|key| self.images.remove(key)).map(|image| image.patch).collect()
    }

    /// How many there are, and why.
    pub fn made(&self) -> (usize, &[String]) {
        (self.images.len(), &self.reasons)
    }

    /// Why the client holds what it does, where that differs from the last time.
    pub fn news(&mut self, decision: &Decision) -> Option<String> {
        (self.reasons != decision.reasons).then(|| {
            self.reasons.clone_from(&decision.reasons);
            decision.reasons.join("; ")
        })
    }
}
