//! What was chosen of a file: a scene, a variant of its materials.

use super::document::Document;
use crate::load::LoadError;
use crate::load::choice::{Choice, Offer, chosen_by, find};

impl Document {
    /// Shows what was chosen, as if the file had said so; a camera is chosen among those of the scene.
    pub fn choose(&mut self, choice: &Choice) -> Result<(), LoadError> {
        if let Some(chosen) = &choice.scene {
            self.scene = Some(find("scene", chosen, &self.scene_names())?);
        }
        if let Some(chosen) = &choice.variant {
            let variant = find("variant", chosen, &self.variant_names())?;
            for primitive in self.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
                let mappings = primitive.extensions.variants.iter().flat_map(|variants| &variants.mappings);
                let mapped = mappings.into_iter().find(|mapping| mapping.variants.contains(&variant));
                // Where it is in none, it keeps its own.
                primitive.material = mapped.map(|mapping| mapping.material).or(primitive.material);
            }
        }
        Ok(())
    }

    /// What may be chosen of it, and of the scene that is shown a camera.
    pub fn offer(&self, cameras: &[Vec<&str>]) -> Offer {
        let scenes = chosen_by(&self.scene_names());
        Offer {
            scenes: if scenes.len() > 1 { scenes } else { Vec::new() },
            shown_scene: self.scene.unwrap_or(0),
            variants: chosen_by(&self.variant_names()),
            cameras: chosen_by(cameras),
        }
    }

    fn scene_names(&self) -> Vec<Vec<&str>> {
        self.scenes.iter().map(|scene| scene.name.as_deref().into_iter().collect()).collect()
    }

    fn variant_names(&self) -> Vec<Vec<&str>> {
        self.variants.iter().map(|variant| variant.name.as_deref().into_iter().collect()).collect()
    }
}
