use std::collections::BTreeMap;
use std::sync::Arc;

use protocol::{Lamp, Lighting};
use scene::{Scene, Snapshot};

/// Corners of a lamp.
pub(super) const CORNERS: usize = 4;

/// What a client was sent of lights.
#[derive(Debug, Default)]
pub struct Kept {
    pub(super) lights: BTreeMap<u16, KeptLight>,
    reasons: Vec<String>,
}

/// A light that was looked from.
#[derive(Debug)]
pub(super) struct KeptLight {
    lamp: Lamp,
    snapshot: Arc<Snapshot>,
    /// `None` where it casts nothing.
    pub set: Option<Set>,
}

/// What a light sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Set {
    /// Samples that it began with.
    pub samples: usize,
    /// Corners that were not looked from since something moved.
    pub due: usize,
    /// Looks so far.
    pub looks: usize,
}

impl KeptLight {
    pub fn new(lamp: Lamp, snapshot: &Arc<Snapshot>, set: Option<Set>) -> KeptLight {
        KeptLight { lamp, snapshot: snapshot.clone(), set }
    }

    /// Notes how everything is now; whether anything of it moved since it was last noted.
    pub fn moved(&mut self, lamp: Lamp, scene: &Scene, snapshot: &Arc<Snapshot>) -> bool {
        let deformed = || scene.instances.iter().any(|instance| instance.deforms);
        let before = &self.snapshot;
        let is_same = self.lamp == lamp
            && (Arc::ptr_eq(before, snapshot)
                || before.world_from_mesh == snapshot.world_from_mesh
                    && (before.time_s == snapshot.time_s || !deformed()));
        (self.lamp, self.snapshot) = (lamp, snapshot.clone());
        !is_same
    }
}

impl Kept {
    /// The lamps to serve, by their numbers in the lighting: see the module.
    pub(super) fn wanted(&self, lighting: &Lighting, eye_world: glam::DVec3) -> Vec<(u16, Lamp)> {
        let strongest = lighting.strongest_at(eye_world).into_iter().take(Lighting::MAX_CASTING);
        let lamp = |light: usize| Some((u16::try_from(light).ok()?, Lamp::of(lighting.lights.get(light)?)?));
        let mut wanted: Vec<(u16, Lamp)> = strongest.filter_map(lamp).collect();
        let others = self.lights.keys().filter_map(|&light| lamp(light.into()));
        let others: Vec<_> = others.filter(|(light, _)| wanted.iter().all(|(other, _)| other != light)).collect();
        wanted.extend(others);
        wanted.truncate(Lighting::MAX_CASTING);
        wanted
    }

    /// Forgets the lights that are not among the wanted; which they are.
    pub(super) fn drop_others(&mut self, wanted: &[(u16, Lamp)]) -> Vec<u16> {
        let is_wanted = |light: &u16| wanted.iter().any(|(other, _)| other == light);
        let others: Vec<u16> = self.lights.keys().copied().filter(|light| !is_wanted(light)).collect();
        others.iter().for_each(|light| drop(self.lights.remove(light)));
        others
    }

    /// Why the client holds what it does, where that differs from the last time.
    pub(super) fn news(&mut self) -> Option<String> {
        let reason = |(light, kept): (&u16, &KeptLight)| match kept.set {
            Some(set) => format!("light {light}: a set of {} samples, followed where something moves", set.samples),
            None => format!("light {light} casts nothing on anything: no images"),
        };
        let mut reasons: Vec<String> = self.lights.iter().map(reason).collect();
        if reasons.is_empty() {
            reasons.push("none with an area: no images".to_owned());
        }
        (self.reasons != reasons).then(|| {
            self.reasons.clone_from(&reasons);
            reasons.join("; ")
        })
    }
}
