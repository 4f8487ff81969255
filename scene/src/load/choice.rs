//! Which of several things of a file is shown, and which way up.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, DVec3};

use super::LoadError;
use super::source::shorten;

/// Which of several things of a file is shown, each by its name or its number from 0; `None`: what the file says, or its first. Only glTF files
/// have any.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Choice {
    /// A scene.
    pub scene: Option<String>,
    /// A variant of its materials (`KHR_materials_variants`).
    pub variant: Option<String>,
    /// The perspective camera that viewers begin at, by its own name or its node's.
    pub camera: Option<String>,
    /// Which axis is up, in a file that does not say.
    pub up: Up,
}

/// The axis that is up in OBJ, PLY and STL files, which do not say; in glTF files it is y.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Up {
    /// As in most files of models.
    #[default]
    Y,
    /// As in most files of maps, scans and machine parts.
    Z,
}

impl Up {
    /// To the world, where y is up: no number changes but in its sign.
    pub(super) fn world_from_file(self) -> DAffine3 {
        match self {
            Up::Y => DAffine3::IDENTITY,
            Up::Z => DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y)),
        }
    }
}

/// What may be chosen of a file, each by its name, or by its number where it has none of its own. Nothing where there is nothing to choose.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Offer {
    /// Scenes, where there are several.
    pub scenes: Vec<String>,
    /// The one that is shown.
    pub shown_scene: usize,
    /// Variants of its materials.
    pub variants: Vec<String>,
    /// Cameras of the scene that is shown, as [`crate::Scene::cameras`] has them.
    pub cameras: Vec<String>,
}

/// What each of some things is chosen by, of the names that it goes by: the first that no thing before it has, or its number.
pub(super) fn chosen_by(names: &[Vec<&str>]) -> Vec<String> {
    let mut taken: HashSet<&str> = HashSet::new();
    let by = names.iter().enumerate().map(|(index, own)| {
        let name = own.iter().find(|name| !taken.contains(*name));
        taken.extend(own);
        name.map_or_else(|| index.to_string(), |name| (*name).to_owned())
    });
    by.collect()
}

impl Choice {
    /// Refuses any choice, as there is none.
    pub fn must_be_of_nothing(&self) -> Result<(), LoadError> {
        let of = |what, chosen: &Option<String>| chosen.as_ref().map_or(Ok(0), |chosen| find(what, chosen, &[]));
        of("scene", &self.scene)?;
        of("variant", &self.variant)?;
        of("camera", &self.camera).map(drop)
    }
}

/// The number of what was chosen among things, each with the names it goes by: a name before a number.
pub(super) fn find(what: &'static str, chosen: &str, names: &[Vec<&str>]) -> Result<usize, LoadError> {
    let by_name = names.iter().position(|names| names.contains(&chosen));
    let by_number = || chosen.parse().ok().filter(|&number: &usize| number < names.len());
    by_name.or_else(by_number).ok_or_else(|| {
        let told = names.iter().take(MOST_TOLD).enumerate().map(|(number, names)| match names.first() {
            Some(name) => format!("{:?}", shorten(name)),
            None => number.to_string(),
        });
        let mut there: Vec<String> = told.collect();
        if names.len() > MOST_TOLD {
            there.push(format!("{} more", names.len() - MOST_TOLD));
        }
        let there = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
        LoadError::NotThere { what, chosen: shorten(chosen).to_owned(), there }
    })
}

/// So many names are told to who chose none of them.
const MOST_TOLD: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_chosen_by_a_name_of_its_own_however_many_there_are() {
        let names = [vec!["a", "b"], vec!["a"], vec![], vec!["a", "c"]];
        assert_eq!(chosen_by(&names), ["a", "1", "2", "c"]);
        // A file may have as many as its bytes allow; that this ends soon is the test.
        assert_eq!(chosen_by(&vec![vec!["same"]; 1 << 20]).len(), 1 << 20);
    }
}
