use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use camera::Bounds;
use glam::DVec3;
use protocol::Lighting;
use scene::{Scene, Snapshot};

use super::caster::Views;
use super::places::Places;
use crate::whereabouts;

/// What a client was sent of lights.
#[derive(Debug, Clone, Default)]
pub struct Kept {
    pub(super) lights: BTreeMap<u16, KeptLight>,
    /// The scene as it was looked at last, and a box around it.
    pub(super) scene: Option<(Arc<Snapshot>, Bounds)>,
    reasons: Vec<String>,
}

/// A light that was looked from.
#[derive(Debug, Clone)]
pub(super) struct KeptLight {
    /// From which points, of a lamp.
    pub places: Places,
    /// From where.
    pub views: Views,
    /// `None` where it casts nothing.
    pub set: Option<Set>,
}

/// What a light sees.
#[derive(Debug, Clone, Default)]
pub(super) struct Set {
    /// Samples that it began with.
    pub samples: usize,
    /// Turns that were not looked at since something moved.
    pub due: VecDeque<usize>,
    /// Looks so far.
    pub looks: usize,
    /// Looks when the points of a lamp were chosen last.
    pub looks_at_choice: usize,
}

impl Set {
    /// Something moved: every turn is due, those first that were due longest.
    pub fn all_due(&mut self, turns: usize) {
        let next = self.due.front().copied().unwrap_or(self.looks % turns.max(1));
        self.due = (0..turns).map(|turn| (next + turn) % turns).collect();
    }

    /// Something is seen from elsewhere by these turns.
    pub fn also_due(&mut self, turns: impl Iterator<Item = usize>) {
        for turn in turns {
            if !self.due.contains(&turn) {
                self.due.push_back(turn);
            }
        }
    }
}

impl Kept {
    /// Whether anything moved since the scene was last looked at.
    pub(super) fn is_moved(&self, scene: &Scene, snapshot: &Arc<Snapshot>) -> bool {
        let Some((before, _)) = &self.scene else { return true };
        whereabouts::is_moved(scene, before, snapshot)
    }

    /// The lights to serve, by their numbers in the lighting: see the module.
    pub(super) fn wanted(&self, lighting: &Lighting, eye_world: DVec3) -> Vec<u16> {
        let strongest = lighting.strongest_at(eye_world).into_iter().take(Lighting::MAX_CASTING);
        let mut wanted: Vec<u16> = strongest.filter_map(|light| u16::try_from(light).ok()).collect();
        let others: Vec<u16> = self.lights.keys().copied().filter(|light| !wanted.contains(light)).collect();
        wanted.extend(others.into_iter().filter(|light| usize::from(*light) < lighting.lights.len()));
        wanted.truncate(Lighting::MAX_CASTING);
        wanted
    }

    /// Forgets the lights that are not among the wanted; which they are.
    pub(super) fn drop_others(&mut self, wanted: &[u16]) -> Vec<u16> {
        let others: Vec<u16> = self.lights.keys().copied().filter(|light| !wanted.contains(light)).collect();
        others.iter().for_each(|light| drop(self.lights.remove(light)));
        others
    }

    /// How many lights cast, and how many cast nothing on anything.
    pub fn made(&self) -> (usize, usize) {
        let casting = self.lights.values().filter(|kept| kept.set.is_some()).count();
        (casting, self.lights.len() - casting)
    }

    /// Why the client holds what it does, where that differs from the last time.
    pub(super) fn news(&mut self) -> Option<String> {
        let reason = |(light, kept): (&u16, &KeptLight)| match &kept.set {
            Some(set) => format!("light {light}: a set of {} samples, followed where something moves", set.samples),
            None => format!("light {light} casts nothing on anything: no images"),
        };
        let mut reasons: Vec<String> = self.lights.iter().map(reason).collect();
        if reasons.is_empty() {
            reasons.push("none casts: no images".to_owned());
        }
        (self.reasons != reasons).then(|| {
            self.reasons.clone_from(&reasons);
            reasons.join("; ")
        })
    }
}
