//! What lights see: surfaces that cast their shadows, and nothing else.
//!
//! Xie, Wang, Popescu 2016, section 5: images from the corners of a light hold all that may stand before it, also what the viewer never
//! saw. So it is here for every light that casts. A server sends them as patches of [`Purpose::Light`]; here they become a store of surfaces a light. A light with patches but
//! without a sample in them casts nothing, and nothing is drawn for it; of a light without patches a server has not spoken (yet), and
//! everything held casts, as far as that goes.

use std::collections::BTreeMap;

use camera::Pinhole;
use glam::{DAffine3, DVec3};
use gpu::Gpu;
use protocol::{Held, Purpose, Update};
use surface::{BuiltSurfaces, CornerRules, Corners, HeldSurfaces};

use crate::receive::follow::Follow;

/// See the module.
#[derive(Debug)]
pub struct LightImages {
    gpu: Gpu,
    corners: Corners,
    /// By the light's number in the lighting.
    seen: BTreeMap<u16, HeldSurfaces>,
    /// The views of the patches that are held of each.
    views: BTreeMap<u16, Vec<Pinhole>>,
    /// Counts what may have changed a shadow.
    revision: u64,
}

impl LightImages {
    /// Holds nothing yet.
    pub fn new(gpu: &Gpu, corners: Corners) -> LightImages {
        LightImages { gpu: gpu.clone(), corners, seen: BTreeMap::new(), views: BTreeMap::new(), revision: 0 }
    }

    /// What a light sees, by its place in the lighting; `None` where that is not known.
    pub fn seen_by(&self, light: usize) -> Option<&HeldSurfaces> {
        u16::try_from(light).ok().and_then(|light| self.seen.get(&light))
    }

    /// How wide a sample of a light's images is at a point that they show, by the light's place in the lighting: the narrowest; `None` where none shows it.
    pub fn sample_m(&self, light: usize, p_world: DVec3) -> Option<f64> {
        let views = u16::try_from(light).ok().and_then(|light| self.views.get(&light))?;
        let sample_m = |view: &Pinhole| {
            let p_eye = view.world_from_eye.inverse().transform_point(p_world);
            let place = view.image_from_eye(p_eye).filter(|place| view.contains(*place));
            place.map(|_| p_eye.z / view.focal_px)
        };
        views.iter().filter_map(sample_m).min_by(f64::total_cmp)
    }

    /// A number that grows with every change of what a light sees.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Builds everything anew, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.revision += 1;
        self.seen.clear();
        self.views = views(held);
        for light in lights(held) {
            self.store(light).rebuild(held);
        }
    }

    /// Puts rigid objects where they are when the next picture is seen.
    pub fn move_objects(&mut self, world_from_objects: &BTreeMap<u16, DAffine3>) {
        let before = self.revisions();
        self.seen.values_mut().for_each(|surfaces| surfaces.set_poses(world_from_objects));
        self.revision += u64::from(self.revisions() != before);
    }

    fn store(&mut self, light: u16) -> &mut HeldSurfaces {
        let empty = || HeldSurfaces::with_corners(&self.gpu, self.corners, CornerRules::default());
        self.seen.entry(light).or_insert_with(|| empty().of(Purpose::Light(light)))
    }
}

impl Follow for LightImages {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces) {
        if anew {
            self.revision += 1;
            self.seen.clear();
        }
        let (before, known) = (self.revisions(), lights(held));
        self.views = views(held);
        self.seen.retain(|light, _| known.contains(light));
        for light in known {
            // A new light's patches came by this very update.
            self.store(light).apply_built(held, update, built);
        }
        self.revision += u64::from(self.revisions() != before);
    }
}

impl LightImages {
    fn revisions(&self) -> BTreeMap<u16, u64> {
        self.seen.iter().map(|(light, surfaces)| (*light, surfaces.revision())).collect()
    }
}

/// The lights that patches are held of, ascending.
fn lights(held: &Held) -> Vec<u16> {
    views(held).into_keys().collect()
}

/// The views of the patches of each light.
fn views(held: &Held) -> BTreeMap<u16, Vec<Pinhole>> {
    let mut views: BTreeMap<u16, Vec<Pinhole>> = BTreeMap::new();
    for held in held.patches.values() {
        let Purpose::Light(light) = held.patch.purpose else { continue };
        views.entry(light).or_default().extend(held.patch.image.camera.pinhole());
    }
    views
}
