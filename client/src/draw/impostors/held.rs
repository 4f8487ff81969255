//! From what is held to impostors.

use impostor::Sample;
use protocol::{Edit, Held, Patch, PatchId, Purpose, Update};
use surface::BuiltSurfaces;

use super::Impostors;
use super::image::{ImpostorImage, ImpostorKind, UnfitImage};
use crate::receive::follow::Follow;

/// Pixels of all impostors together: 350 MB of textures, and twenty times what a server sends for a reflector.
const MOST_PIXELS: u64 = 1 << 23;

impl ImpostorImage {
    /// Of a patch; `None` of one that is no impostor.
    pub fn of_patch(patch: &Patch) -> Option<ImpostorImage> {
        let (kind, object) = match patch.purpose {
            Purpose::Impostor(object) => (ImpostorKind::Object(object), Some(object)),
            Purpose::Inside(object) => (ImpostorKind::Inside(object), Some(object)),
            Purpose::Relief(object) => (ImpostorKind::Relief(object), Some(object)),
            Purpose::Environment => (ImpostorKind::Environment, None),
            Purpose::Eye
            | Purpose::Light(_)
            | Purpose::Rest
            | Purpose::Camera
            | Purpose::Occluders
            | Purpose::Layer(_)
            | Purpose::Body => return None,
        };
        let image = &patch.image;
        let (width, height) = image.mask.size_px();
        let mut samples = vec![Sample::EMPTY; width as usize * height as usize];
        let mut colour = vec![[0; 4]; samples.len()];
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let at = y as usize * width as usize + x as usize;
            let normal_world = image.normal_at(index).as_dvec3();
            samples[at] = Sample { w: image.depth_scale.w(image.depth[index]).into(), normal_world };
            let [red, green, blue] = image.colour[index];
            colour[at] = [red, green, blue, image.material[index]];
        }
        let pose = patch.objects.iter().find(|pose| Some(pose.object) == object);
        let pose = pose.map(|pose| (pose.object, pose.world_from_object));
        Some(ImpostorImage { kind, camera: image.camera.clone(), samples, colour, pose })
    }
}

impl Impostors {
    /// Puts up everything held, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.clear();
        held.patches.values().for_each(|held| self.hold(&held.patch));
    }

    fn hold(&mut self, patch: &Patch) {
        if matches!(
            patch.purpose,
            Purpose::Eye
                | Purpose::Light(_)
                | Purpose::Rest
                | Purpose::Camera
                | Purpose::Occluders
                | Purpose::Layer(_)
                | Purpose::Body
        ) {
            return;
        }
        self.remove(patch.id.0);
        // Before anything is allocated: a mask costs a bit a pixel, an impostor hundreds.
        if let Err(error) = fits(self.pixels(), patch.image.mask.size_px()) {
            return say(patch.id, &error);
        }
        let Some(image) = ImpostorImage::of_patch(patch) else { return };
        if let Err(error) = self.insert(patch.id.0, &image) {
            // The rest of the picture is as good as it was.
            say(patch.id, &error);
        }
    }
}

/// Whether an impostor of a size may be held beside those that have `held_px` together.
fn fits(held_px: u64, (width, height): (u32, u32)) -> Result<(), UnfitImage> {
    let pixels = held_px.saturating_add(u64::from(width) * u64::from(height));
    if pixels > MOST_PIXELS { Err(UnfitImage::TooMany { pixels }) } else { Ok(()) }
}

#[cfg(not(target_arch = "wasm32"))]
fn say(id: PatchId, error: &UnfitImage) {
    tracing::warn!("{id:?} is not shown: {error}");
}

#[cfg(target_arch = "wasm32")]
fn say(_: PatchId, _: &UnfitImage) {}

impl Follow for Impostors {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, _: &mut BuiltSurfaces) {
        if anew {
            return self.rebuild(held);
        }
        for edit in &update.edits {
            match edit {
                Edit::Clear => self.clear(),
                Edit::Add(patch) => self.hold(patch),
                Edit::Remove(id) => self.remove(id.0),
                // Where objects are, and which are shown by reliefs, is read as they are drawn.
                Edit::Move(_)
                | Edit::Shift(_)
                | Edit::Body(..)
                | Edit::Place(..)
                | Edit::Withdraw(_)
                | Edit::Delete(..)
                | Edit::Trim(..) => {}
                Edit::Materials(_) | Edit::Light(_) | Edit::Sky(_) | Edit::Join(_) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use camera::{Camera, Pinhole, Rigid};
    use gpu::Gpu;
    use protocol::{DepthImage, DepthScale, Mask};

    use super::*;

    /// An image of surroundings with one sample.
    fn patch(id: u32, (width, height): (u32, u32)) -> Patch {
        let mut mask = Mask::empty(width, height);
        mask.set(width / 2, height / 2, true);
        let image = DepthImage {
            camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (width, height), 1.0, 0.1)),
            depth_scale: DepthScale { w_min: 1.0, w_step: 0.0 },
            mask,
            depth: vec![0],
            normal: vec![[0; 2]],
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: vec![[0; 3]],
            object: vec![1],
            material: vec![0],
        };
        Patch { id: PatchId(id), purpose: Purpose::Environment, capture_time_s: 0.0, objects: Vec::new(), image }
    }

    #[test]
    fn pixels_of_all_together_are_held_up_to_the_most() {
        let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
        let mut impostors = Impostors::new(&gpu);
        let pixels = |impostors: &Impostors| (impostors.len(), impostors.pixels());
        impostors.hold(&patch(1, (8, 4)));
        impostors.hold(&patch(2, (16, 4)));
        impostors.hold(&patch(1, (4, 4)));
        assert_eq!(pixels(&impostors), (2, 80), "the newer one took the place of the older");
        impostors.hold(&patch(3, (2048, 4096)));
        assert_eq!(pixels(&impostors), (2, 80), "as many as may be held alone, and there are others");
        impostors.remove(1);
        assert_eq!(pixels(&impostors), (1, 64));
        assert_eq!(fits(MOST_PIXELS - 64, (8, 8)), Ok(()));
        assert_eq!(fits(MOST_PIXELS - 63, (8, 8)), Err(UnfitImage::TooMany { pixels: MOST_PIXELS + 1 }));
        assert!(fits(u64::MAX, (u32::MAX, u32::MAX)).is_err());
    }
}
