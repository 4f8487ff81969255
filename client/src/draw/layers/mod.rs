//! What the eye sees through: surfaces that are blended with what lies behind them, in layers that a server sends as patches of [`Purpose::Layer`].
//!
//! Each layer is a store of surfaces of its own, drawn and lit by itself, so that no layer hides another. Then the pass sorts the layers of each pixel
//! by depth, leaves out what the opaque picture hides, and puts one over the other. Where none is held nothing of it is made.

mod pass;

use std::collections::BTreeMap;

use glam::DAffine3;
use gpu::Gpu;
use protocol::{Held, Purpose, Update};
use surface::{BuiltSurfaces, CornerRules, Corners, HeldSurfaces};

use crate::receive::follow::Follow;

pub(crate) use pass::{LayersPass, Over, Seen};

/// See the module.
#[derive(Debug)]
pub struct Layers {
    gpu: Gpu,
    corners: Corners,
    /// By number; those that anything is held of.
    held: BTreeMap<u8, HeldSurfaces>,
}

impl Layers {
    /// Holds nothing yet.
    pub fn new(gpu: &Gpu, corners: Corners) -> Layers {
        Layers { gpu: gpu.clone(), corners, held: BTreeMap::new() }
    }

    /// The surfaces of each layer that anything is held of.
    pub fn surfaces(&self) -> impl ExactSizeIterator<Item = &HeldSurfaces> {
        self.held.values()
    }

    /// Builds everything anew, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.held.clear();
        for layer in layers(held) {
            self.store(layer).rebuild(held);
        }
    }

    /// Puts rigid objects where they are when the next picture is seen; whether that changes it.
    pub fn move_objects(&mut self, world_from_objects: &BTreeMap<u16, DAffine3>) -> bool {
        let moved = |surfaces: &mut HeldSurfaces| {
            let before = surfaces.revision();
            surfaces.set_poses(world_from_objects);
            surfaces.revision() != before
        };
        self.held.values_mut().map(moved).fold(false, |any, moved| any | moved)
    }

    fn store(&mut self, layer: u8) -> &mut HeldSurfaces {
        let empty = || HeldSurfaces::with_corners(&self.gpu, self.corners, CornerRules::default());
        self.held.entry(layer).or_insert_with(|| empty().of(Purpose::Layer(layer)))
    }
}

impl Follow for Layers {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces) {
        if anew {
            self.held.clear();
        }
        let known = layers(held);
        self.held.retain(|layer, _| known.contains(layer));
        for layer in known {
            // A new layer's patches came by this very update.
            self.store(layer).apply_built(held, update, built);
        }
    }
}

/// The layers that patches are held of, ascending.
fn layers(held: &Held) -> Vec<u8> {
    let layer = |purpose: Purpose| if let Purpose::Layer(layer) = purpose { Some(layer) } else { None };
    let mut layers: Vec<u8> = held.patches.values().filter_map(|held| layer(held.patch.purpose)).collect();
    layers.sort_unstable();
    layers.dedup();
    layers
}
