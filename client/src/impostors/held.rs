//! From what is held to impostors.

use impostor::Sample;
use protocol::{Edit, Held, Patch, PatchId, Purpose, Update};

use super::{ImpostorImage, ImpostorKind, Impostors, UnfitImage};
use crate::viewer::Follow;

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
            Purpose::Eye | Purpose::Light(_) => return None,
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
        if patch.purpose == Purpose::Eye {
            return;
        }
        self.remove(patch.id.0);
        // Before anything is allocated: a mask costs a bit a pixel, an impostor hundreds.
        let (width, height) = patch.image.mask.size_px();
        let pixels = self.pixels() + u64::from(width) * u64::from(height);
        if pixels > MOST_PIXELS {
            return say(patch.id, &UnfitImage::TooMany { pixels });
        }
        let Some(image) = ImpostorImage::of_patch(patch) else { return };
        if let Err(error) = self.insert(patch.id.0, &image) {
            // The rest of the picture is as good as it was.
            say(patch.id, &error);
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn say(id: PatchId, error: &UnfitImage) {
    tracing::warn!("{id:?} is not shown: {error}");
}

#[cfg(target_arch = "wasm32")]
fn say(_: PatchId, _: &UnfitImage) {}

impl Follow for Impostors {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool) {
        if anew {
            return self.rebuild(held);
        }
        for edit in &update.edits {
            match edit {
                Edit::Clear => self.clear(),
                Edit::Add(patch) => self.hold(patch),
                Edit::Remove(id) => self.remove(id.0),
                // Where objects are, and which are shown by reliefs, is read as they are drawn.
                Edit::Move(_) | Edit::Place(..) | Edit::Withdraw(_) | Edit::Delete(..) | Edit::Trim(..) => {}
                Edit::Materials(_) | Edit::Light(_) => {}
            }
        }
    }
}
