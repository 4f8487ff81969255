//! Which of several things of a file is shown.

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
