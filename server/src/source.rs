//! Which scene to serve: a built-in one by its name, a file, or a file's model as the mirror of a built-in one.

use std::path::Path;

use scene::Scene;
use scene::load::{Choice, LoadError, LoadLimits, Progress};
use thiserror::Error;

use crate::scale::scaled;

/// Why there is no scene.
#[derive(Debug, Error)]
pub enum SourceError {
    /// Neither a built-in name nor a file.
    #[error("{name:?} is neither a file nor a built-in scene; built in are: {}", scene::builtin::offered().collect::<Vec<_>>().join(", "))]
    Unknown {
        /// As given.
        name: String,
    },
    /// The file was refused.
    #[error(transparent)]
    Load(#[from] LoadError),
}

/// Whether `name` names a file, by itself. The name of a built-in scene is that scene's, whatever is called so in the folder; `./NAME` is the file.
pub fn is_file(name: &str) -> bool {
    !scene::builtin::has(name) && Path::new(name).exists()
}

/// Loads the scene that `name` names (see [`is_file`]), `scale` times as large. `NAME+FILE` is the built-in
/// scene of that name with the file's model as what reflects there; see [`scene::builtin::load_with`].
pub fn load(name: &str, scale: f64, progress: &(dyn Fn(Progress) + Sync)) -> Result<Scene, SourceError> {
    load_chosen(name, &Choice::default(), scale, progress)
}

/// The same of a file that holds several things.
pub fn load_chosen(
    name: &str,
    choice: &Choice,
    scale: f64,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Scene, SourceError> {
    let path = Path::new(name);
    if !is_file(name) {
        choice.must_be_of_nothing()?;
    }
    let scene = if is_file(name) {
        scene::load::load_chosen(path, choice, &LoadLimits::default(), progress)?
    } else if let Some(scene) = scene::builtin::load(name) {
        scene
    } else if let Some((builtin, file)) = name.split_once('+').filter(|(_, file)| Path::new(file).exists())
        && let Some(scene) =
            scene::builtin::load_with(builtin, &scene::load::load(Path::new(file), &LoadLimits::default(), progress)?)
    {
        scene
    } else {
        return Err(SourceError::Unknown { name: name.to_owned() });
    };
    Ok(if scale == 1.0 { scene } else { scaled(scene, scale) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_a_scenes_name_hides_nothing() {
        let folder = std::env::temp_dir().join(format!("vantage-source-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("pillars")).expect("a folder");
        assert!(!is_file("pillars"));
        assert!(is_file(folder.join("pillars").to_str().expect("a path")));
        assert!(scene::builtin::has("grass-9-blades") && !scene::builtin::has("grass-0-blades"));
        for name in scene::builtin::offered() {
            assert!(scene::builtin::has(name), "{name}");
        }
        std::fs::remove_dir_all(folder).expect("removed");
    }
}
