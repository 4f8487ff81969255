//! What was chosen of a file: a scene, a variant of its materials.

use super::document::Document;
use crate::load::LoadError;
use crate::load::choice::{Choice, find};

impl Document {
    /// Shows what was chosen, as if the file had said so; a camera is chosen among those of the scene.
    pub fn choose(&mut self, choice: &Choice) -> Result<(), LoadError> {
        if let Some(chosen) = &choice.scene {
            let names: Vec<Vec<&str>> =
                self.scenes.iter().map(|scene| scene.name.as_deref().into_iter().collect()).collect();
            self.scene = Some(find("scene", chosen, &names)?);
        }
        if let Some(chosen) = &choice.variant {
            let names: Vec<Vec<&str>> =
                self.variants.iter().map(|variant| variant.name.as_deref().into_iter().collect()).collect();
            let variant = find("variant", chosen, &names)?;
            for primitive in self.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
                let mappings = primitive.extensions.variants.iter().flat_map(|variants| &variants.mappings);
                let mapped = mappings.into_iter().find(|mapping| mapping.variants.contains(&variant));
                // Where it is in none, it keeps its own.
                primitive.material = mapped.map(|mapping| mapping.material).or(primitive.material);
            }
        }
        Ok(())
    }
}
